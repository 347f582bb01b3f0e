// calibration - the MAP read-out of a weighted fit; knows no log.
#include "host_sim/identify/calibration/map_readout.hpp"

#include <cmath>

#include "host_sim/identify/calibration/barrier_fit.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

PhysicalReadOut ReadOutPhysical(const codegen::Model& model, const Fit& fit) {
  RequirePhysicalPrior(model);
  const Prior prior = MakePrior(model);
  const Eigen::Index size = prior.mean.size();
  BarrierProblem problem;
  problem.model = &model;
  problem.bodies = BodyMean(model);
  problem.bodies_sd = VectorXd::Zero(problem.bodies.size());
  for (int k = 0; k < problem.bodies.size(); ++k)
    if (model.table()[k].state == "estimated") problem.bodies_sd[k] = model.table()[k].sd;
  problem.x = prior.mean;
  problem.x_sd = VectorXd::Zero(size);
  for (const int c : fit.active) problem.x_sd[c] = std::sqrt(prior.covariance(c, c));
  problem.data = [&](const VectorXd& x, bool) {
    DataTerm term{0, VectorXd::Zero(size), MatrixXd::Zero(size, size)};
    for (std::size_t j = 0; j < fit.information.gram.size(); ++j) {
      const double weight = 1 / (fit.sigma[j] * fit.sigma[j] * fit.inflation[j]);
      term.hessian += weight * fit.information.gram[j];
      term.gradient -= weight * fit.information.right[j];
    }
    term.gradient += term.hessian * x;
    return term;
  };
  BarrierFit found = FitWithBarrier(problem);
  return {std::move(found.bodies), std::move(found.bodies_sd), std::move(found.x), found.iterations, found.converged};
}

}  // namespace armcal::calibration
