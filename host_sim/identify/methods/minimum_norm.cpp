// methods - linear models and bodies of smallest norm; knows no method.
#include "host_sim/identify/methods/minimum_norm.hpp"

#include <Eigen/QR>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/io/input_error.hpp"

namespace armcal::calibration {

void ExpectLinear(const Problem& problem, const char* method) {
  const int columns = problem.model->columns();
  for (int k = 0; k < problem.model->nonlinear(); ++k)
    if (problem.lower[columns + k] < problem.upper[columns + k])
      throw io::InputError(std::string(method) + ": expected a linear model, (12); " +
                           problem.model->unknowns()[k].name + " of model " + problem.model->robot().name +
                           " is nonlinear, (13)");
}

bool Varies(const codegen::Model& model, int joint, int column) {
  if (model.is_rigid(column)) return false;
  const codegen::Expr e = model.rows()[joint][column];
  for (const codegen::EffectUnknown& u : model.unknowns())
    if (codegen::Reads(e, e.graph()->Symbol(u.name))) return true;
  return false;
}

Eigen::VectorXd SmallestBodies(const codegen::Model& model, const Eigen::VectorXd& z) {
  return model.base_map().completeOrthogonalDecomposition().solve(z.segment(model.front(), model.rigid()));
}

}  // namespace armcal::calibration
