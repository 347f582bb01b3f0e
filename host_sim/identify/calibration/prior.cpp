// calibration - maps the prior from the table into filter coordinates. Its full covariance matters: a diagonal one in
// (m, m c, I_o) would be worse than none.
#include "host_sim/identify/calibration/prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd BodyMean(const codegen::Model& model) { return model.body_prior().mean; }

std::vector<double> MeanUnknowns(const codegen::Model& model) {
  std::vector<double> eta;
  for (int k = 0; k < model.nonlinear(); ++k)
    eta.push_back(model.table()[model.parameters() - model.nonlinear() + k].mean);
  return eta;
}

MatrixXd CovarianceRoot(const MatrixXd& covariance) {
  const VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseMax(1e-300);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
      MatrixXd(scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal()));
  return scale.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

namespace {

constexpr int kDrawnStates = 256;

// [columns] The deviation at which a column's torque, over states within the arm's limits, is as large as the limit of
// one of its joints.
VectorXd WideDeviations(const codegen::Model& model) {
  const int n = model.joints();
  codegen::Signals s;
  s.t = VectorXd::LinSpaced(kDrawnStates, 0, kDrawnStates - 1);
  s.q.resize(kDrawnStates, n), s.qd = s.q, s.qdd = s.q;
  // Multiples of irrational numbers fill each range evenly.
  const auto share = [](int k, int dimension) {
    const double turns = k * std::sqrt(2 + dimension * (dimension + 3));
    return turns - std::floor(turns);
  };
  for (int j = 0; j < n; ++j) {
    const codegen::Joint& joint = model.robot().joint[j];
    const auto [lower, upper] = joint.position_limit_rad;
    for (int k = 0; k < kDrawnStates; ++k) {
      s.q(k, j) = lower + share(k, 3 * j) * (upper - lower);
      s.qd(k, j) = (2 * share(k, 3 * j + 1) - 1) * joint.speed_limit_radps;
      s.qdd(k, j) = (2 * share(k, 3 * j + 2) - 1) * joint.acceleration_limit_radps2;
    }
  }
  const VectorXd none = VectorXd::Zero(model.columns());
  std::vector<MatrixXd> row;
  model.Regressor(s, {none.data(), static_cast<std::size_t>(none.size())}, MeanUnknowns(model), row);
  VectorXd largest = VectorXd::Zero(model.columns());
  for (int j = 0; j < n; ++j)
    largest = largest.cwiseMax(row[static_cast<std::size_t>(j)].colwise().norm().transpose() / std::sqrt(kDrawnStates) /
                               model.robot().joint[j].torque_limit_Nm);
  return largest.cwiseInverse();
}

}  // namespace

Prior MakePrior(const codegen::Model& model) {
  const int columns = model.columns(), n = model.joints();
  Prior prior;
  prior.columns = columns;
  prior.informative = model.robot().has_prior;
  prior.mean = VectorXd::Zero(columns + n);
  prior.covariance = MatrixXd::Zero(columns + n, columns + n);
  if (prior.informative) {
    const MatrixXd& B = model.base_map();
    const codegen::BodyPrior& bodies = model.body_prior();
    prior.mean.segment(model.front(), model.rigid()) = B * bodies.mean;
    prior.covariance.block(model.front(), model.front(), model.rigid(), model.rigid()) =
        B * bodies.covariance * B.transpose();
  }
  for (int c = 0; c < columns; ++c) {
    if (model.is_rigid(c)) {
      prior.active.push_back(c);
      continue;
    }
    const auto& p = model.table()[model.table_index(c)];
    prior.mean[c] = p.mean;
    prior.covariance(c, c) = p.sd * p.sd;
    if (p.state == "estimated") prior.active.push_back(c);
  }
  if (!prior.informative) {
    const VectorXd wide = WideDeviations(model);
    for (const int c : prior.active)
      if (std::isfinite(wide[c])) prior.covariance(c, c) = wide[c] * wide[c];
  }
  for (int j = 0; j < n; ++j) {
    const double tolerance = model.robot().joint[j].motor.torque_constant_tolerance;
    prior.covariance(columns + j, columns + j) = tolerance * tolerance / 3;  // uniform over +- tolerance
    if (tolerance > 0) prior.active.push_back(columns + j);
  }
  return prior;
}

VectorXd ReadOutBodies(const codegen::Model& model, const VectorXd& base) {
  const codegen::BodyPrior& prior = model.body_prior();
  return prior.mean + codegen::ReadOut(prior, model.base_map()) * (base - model.base_map() * prior.mean);
}

Eigen::Matrix4d PseudoInertia(const double* b) {
  const double half = 0.5 * (b[4] + b[7] + b[9]);
  Eigen::Matrix4d J;
  J << half - b[4], -b[5], -b[6], b[1], -b[5], half - b[7], -b[8], b[2], -b[6], -b[8], half - b[9], b[3], b[1], b[2],
      b[3], b[0];
  return J;
}

bool IsPhysical(const VectorXd& bodies) {
  for (int j = 0; j < bodies.size() / 11; ++j) {
    const Eigen::LLT<Eigen::Matrix4d> factor(PseudoInertia(&bodies[11 * j]));
    if (factor.info() != Eigen::Success || bodies[11 * j + 10] < 0) return false;
  }
  return true;
}

}  // namespace armcal::calibration
