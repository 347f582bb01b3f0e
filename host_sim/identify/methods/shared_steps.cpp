// methods - linearises the model, solves with a prior, and reads out the bodies.
#include "host_sim/identify/methods/shared_steps.hpp"
#include <time.h>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Linearised Linearise(const Problem& problem, const VectorXd& z) {
  const int columns = problem.model->columns(), unknowns = problem.model->nonlinear();
  Rows rows = StackRows(problem, z);
  Linearised out;
  out.residual = rows.tau - rows.K * z.head(columns);
  if (unknowns == 0) {
    out.A = std::move(rows.K);
  } else {
    out.A.resize(rows.K.rows(), columns + unknowns);
    out.A.leftCols(columns) = rows.K;
    out.A.rightCols(unknowns) = StackJacobian(problem, z, rows);
  }
  VectorXd weight(out.A.rows());
  for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = 1 / problem.sigma_Nm[rows.joint[r]];
  out.A.array().colwise() *= weight.array();
  out.residual.array() *= weight.array();
  out.joint = std::move(rows.joint);
  return out;
}

std::vector<int> FreeCoordinates(const Problem& problem) {
  const codegen::Model& model = *problem.model;
  std::vector<int> free;
  for (int c = 0; c < model.columns(); ++c)
    if (model.is_rigid(c) || model.table()[model.table_index(c)].state == "estimated") free.push_back(c);
  for (int c = model.columns(); c < problem.start.size(); ++c)
    if (problem.lower[c] < problem.upper[c]) free.push_back(c);
  return free;
}

VectorXd SolveRegularised(const Problem& problem, const MatrixXd& gram, const VectorXd& right, MatrixXd* covariance) {
  Prior prior;
  prior.mean = problem.start;
  prior.covariance = problem.covariance;
  prior.active = FreeCoordinates(problem);
  prior.columns = problem.model->columns();
  Information sums;
  sums.gram = {gram};
  sums.right = {right};
  return SolveWithPrior(sums, VectorXd::Ones(1), prior, prior.active, covariance);
}

MatrixXd PriorFactor(const Problem& problem) {
  const std::vector<int> free = FreeCoordinates(problem);
  const int count = static_cast<int>(free.size());
  MatrixXd P(count, count);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < count; ++k) P(i, k) = problem.covariance(free[i], free[k]);
  const MatrixXd root = CovarianceRoot(P);
  MatrixXd L = MatrixXd::Zero(problem.start.size(), count);
  for (int i = 0; i < count; ++i) L.row(free[i]) = root.row(i);
  return L;
}

void ClampEta(const Problem& problem, VectorXd& z) {
  for (int c = problem.model->columns(); c < z.size(); ++c) z[c] = std::clamp(z[c], problem.lower[c], problem.upper[c]);
}

bool Stopped(const Problem& problem) { return problem.stop && problem.stop->load(std::memory_order_relaxed); }

double CpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void Finish(const Problem& problem, double began, Solution& solution) {
  const codegen::Model& model = *problem.model;
  if (solution.bodies.size() == 0 && solution.z.allFinite())
    solution.bodies = problem.covariance.size() > 0 && model.robot().has_prior
                          ? ReadOutBodies(model, solution.z.segment(model.front(), model.rigid()))
                          : SmallestBodies(model, solution.z);
  solution.physical = solution.bodies.size() > 0 && solution.bodies.allFinite() && IsPhysical(solution.bodies);
  // Information is 1 / variance. So the prior's share of a coordinate's information is posterior variance over prior
  // variance.
  double share = 0;
  int count = 0;
  if (problem.covariance.size() > 0 && solution.covariance.size() > 0)
    for (const int c : FreeCoordinates(problem))
      if (problem.covariance(c, c) > 0)
        share += std::clamp(solution.covariance(c, c) / problem.covariance(c, c), 0.0, 1.0), ++count;
  solution.from_prior = count ? share / count : 0;
  solution.seconds = CpuSeconds() - began;
}

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
  return model.base_map().completeOrthogonalDecomposition().solve(VectorXd(z.segment(model.front(), model.rigid())));
}

}  // namespace armcal::calibration
