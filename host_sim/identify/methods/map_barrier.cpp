// methods - the most probable parameters under a prior in table coordinates. A log-det barrier keeps bodies possible.
//
// Better than (15), because directions that K does not see stay at the CAD values and every body can exist. A linear
// model costs one Gram matrix and some 20 small steps. A nonlinear one is linearised again in each step.
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// C(x) of the used rows of a linear model. Sums are taken joint by joint, without stacking K.
DataTerm LinearTerm(const Problem& problem, const VectorXd& x) {
  const codegen::Model& model = *problem.model;
  const int columns = model.columns();
  DataTerm term{0, VectorXd::Zero(columns), MatrixXd::Zero(columns, columns)};
  for (const Dataset* log : problem.train) {
    const Information sums = Accumulate(model, *log, x, {});
    for (int j = 0; j < model.joints(); ++j) {
      const double weight = 1 / (problem.sigma_Nm[j] * problem.sigma_Nm[j]);
      term.hessian += weight * sums.gram[j].topLeftCorner(columns, columns);
      term.gradient -= weight * sums.right[j].head(columns);
      term.cost += 0.5 * weight * sums.square[j];
    }
  }
  const VectorXd curved = term.hessian * x;
  term.cost += term.gradient.dot(x) + 0.5 * x.dot(curved);
  term.gradient += curved;
  return term;
}

DataTerm NonlinearTerm(const Problem& problem, const VectorXd& x, bool derivatives) {
  DataTerm term;
  if (!derivatives) {
    const Rows rows = StackRows(problem, x);
    const VectorXd residual = rows.tau - rows.K * x.head(problem.model->columns());
    for (Eigen::Index r = 0; r < residual.size(); ++r)
      term.cost += 0.5 * std::pow(residual[r] / problem.sigma_Nm[rows.joint[r]], 2);
    return term;
  }
  const Linearised here = Linearise(problem, x);
  term.cost = 0.5 * here.residual.squaredNorm();
  term.gradient = -here.A.transpose() * here.residual;
  term.hessian = here.A.transpose() * here.A;
  return term;
}

}  // namespace

Solution MapBarrier(const Problem& problem) {
  const double began = CpuSeconds();
  const codegen::Model& model = *problem.model;
  RequirePhysicalPrior(model);
  if (problem.covariance.size() == 0) throw io::InputError("method map_barrier: expected a prior");
  BarrierProblem barrier;
  barrier.model = &model;
  // The table's bodies, unless the problem starts elsewhere.
  barrier.bodies = ReadOutBodies(model, problem.start.segment(model.front(), model.rigid()));
  if (!IsPhysical(barrier.bodies)) throw io::InputError("method map_barrier: expected a start whose bodies can exist");
  barrier.bodies_sd = VectorXd::Zero(barrier.bodies.size());
  for (int k = 0; k < barrier.bodies.size(); ++k)
    if (model.table()[k].state == "estimated") barrier.bodies_sd[k] = model.table()[k].sd;
  // Only the prior tells of parameters that are in no filter coordinate (zero columns of the map).
  barrier.x = problem.start;
  barrier.x_sd = VectorXd::Zero(problem.start.size());
  for (const int c : FreeCoordinates(problem)) {
    const bool eta = c >= model.columns();
    const double variance = problem.covariance(c, c);
    barrier.x_sd[c] = eta && variance <= 0 ? std::numeric_limits<double>::infinity() : std::sqrt(variance);
  }
  barrier.lower = VectorXd::Constant(problem.start.size(), -std::numeric_limits<double>::infinity());
  barrier.upper = -barrier.lower;
  const int unknowns = model.nonlinear();
  barrier.lower.tail(unknowns) = problem.lower.tail(unknowns);
  barrier.upper.tail(unknowns) = problem.upper.tail(unknowns);
  barrier.quadratic = unknowns == 0 && !model.depends_on_estimate();
  barrier.data = [&](const VectorXd& x, bool derivatives) {
    return unknowns == 0 ? LinearTerm(problem, x) : NonlinearTerm(problem, x, derivatives);
  };
  barrier.stop = problem.stop;
  BarrierFit fit = FitWithBarrier(barrier);
  Solution solution;
  solution.z = std::move(fit.x);
  solution.covariance = std::move(fit.covariance);
  solution.bodies = std::move(fit.bodies);
  solution.iterations = fit.iterations;
  solution.converged = fit.converged && !Stopped(problem);
  if (!fit.converged) solution.remark = "stopped before the last step was small";
  const std::size_t size = static_cast<std::size_t>(problem.start.size() + model.body_parameters());
  solution.memory_bytes = 4 * size * size * sizeof(double);
  if (unknowns > 0) {
    std::size_t rows = 0;
    for (const Dataset* log : problem.train) rows += static_cast<std::size_t>(log->used.sum());
    solution.memory_bytes += 2 * rows * static_cast<std::size_t>(problem.start.size()) * sizeof(double);
  }
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
