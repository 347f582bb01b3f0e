// excitation - value and gradient of the excitation objective; knows no search.
#include "host_sim/identify/excitation/objective.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::excitation {
namespace {

constexpr double kPenalty = 100;  // per sample and unit of squared excess: 1 % too far costs what 1 % of cond gains
constexpr double kRelativeShift = 1e-7;  // of a joint's limit, for the derivative of the regressor by its state

// kPenalty * excess^2 of |x - middle| / half over `share`; adds the derivative by x.
double Excess(double x, double middle, double half, double share, double& derivative) {
  const double used = (x - middle) / half, excess = std::abs(used) / share - 1;
  if (excess <= 0) return 0;
  derivative += 2 * kPenalty * excess * std::copysign(1 / (share * half), used);
  return kPenalty * excess * excess;
}

}  // namespace

Objective::Objective(const Observation& observation, const Criterion& criterion, const SeriesShape& shape, double share)
    : observation_(observation), criterion_(criterion), shape_(shape), share_(share) {
  const codegen::Robot& robot = observation.model().robot();
  t_ = Eigen::VectorXd::LinSpaced(shape.samples, 0, shape.period_s * (shape.samples - 1) / shape.samples);
  for (int order = 0; order < 3; ++order) basis_[order] = Basis(shape.family, t_, shape.period_s, shape.terms, order);
  zero_ = Eigen::MatrixXd::Zero(shape.terms + 1, robot.joints());
  unit_ = zero_;
  Eigen::RowVectorXd peak[3];  // of each term
  for (int order = 0; order < 3; ++order) peak[order] = basis_[order].cwiseAbs().colwise().maxCoeff();
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const auto [low, high] = joint.position_limit_rad;
    for (int i = 0; i < shape.terms; ++i)
      unit_(i, j) = std::min({(high - low) / (2 * peak[0][i]), joint.speed_limit_radps / peak[1][i],
                              joint.acceleration_limit_radps2 / peak[2][i]}) /
                    2;
    unit_(shape.terms, j) = (high - low) / 4;
    zero_(shape.terms, j) = (low + high) / 2;
  }
}

Series Objective::Series(const Eigen::VectorXd& u) const {
  const Eigen::Map<const Eigen::MatrixXd> table(u.data(), unit_.rows(), unit_.cols());
  return {shape_.family, shape_.period_s, zero_ + unit_.cwiseProduct(table)};
}

codegen::Signals Objective::Motion(const Eigen::VectorXd& u) const {
  const Eigen::MatrixXd coefficient = Series(u).coefficient;
  codegen::Signals s;
  s.t = t_;
  s.q = basis_[0] * coefficient, s.qd = basis_[1] * coefficient, s.qdd = basis_[2] * coefficient;
  return s;
}

// d_gram: derivative by the Gram matrix of all model columns (zero where a column is not asked for).
double Objective::SmoothFigure(Eigen::MatrixXd& d_gram) const {
  Eigen::MatrixXd d_asked;
  const double value = excitation::SmoothFigure(criterion_, observation_.Gram(row_, shape_.samples), d_asked);
  if (!std::isfinite(value)) return value;
  d_gram.setZero(observation_.model().columns(), observation_.model().columns());
  d_gram(observation_.columns(), observation_.columns()) = d_asked;
  return value;
}

double Objective::Penalties(const codegen::Signals& s, Adjoint& adjoint) const {
  double sum = 0;
  for (int j = 0; j < unit_.cols(); ++j) {
    const codegen::Joint& joint = observation_.model().robot().joint[j];
    const auto [low, high] = joint.position_limit_rad;
    for (Eigen::Index k = 0; k < s.q.rows(); ++k) {
      sum += Excess(s.q(k, j), (low + high) / 2, (high - low) / 2, share_, adjoint.q(k, j));
      sum += Excess(s.qd(k, j), 0, joint.speed_limit_radps, share_, adjoint.qd(k, j));
      sum += Excess(s.qdd(k, j), 0, joint.acceleration_limit_radps2, share_, adjoint.qdd(k, j));
    }
  }
  return sum;
}

double Objective::TorquePenalty(Eigen::MatrixXd& d_torque) const {
  double sum = 0;
  if (!observation_.model().robot().has_prior) return sum;
  for (int i = 0; i < unit_.cols(); ++i) {
    const Eigen::VectorXd torque = row_[i].topRows(shape_.samples) * observation_.mean();
    for (Eigen::Index k = 0; k < torque.size(); ++k)
      sum += Excess(torque[k], 0, observation_.model().robot().joint[i].torque_limit_Nm, share_, d_torque(k, i));
  }
  return sum;
}

// How far state variable 0..3n-1 (q, qd, qdd of each joint) is moved for its difference quotient.
double Objective::Shift(int variable) const {
  const int n = static_cast<int>(unit_.cols());
  const codegen::Joint& joint = observation_.model().robot().joint[variable % n];
  const double limit = variable < n       ? joint.position_limit_rad[1] - joint.position_limit_rad[0]
                       : variable < 2 * n ? joint.speed_limit_radps
                                          : joint.acceleration_limit_radps2;
  return kRelativeShift * limit;
}

// The motion, and below it once more with each state variable shifted: 1 + 3n blocks of `samples` rows.
void Objective::Perturb(const codegen::Signals& s) {
  const int n = static_cast<int>(unit_.cols()), blocks = 1 + 3 * n;
  perturbed_.t = s.t.replicate(blocks, 1);
  perturbed_.q = s.q.replicate(blocks, 1);
  perturbed_.qd = s.qd.replicate(blocks, 1);
  perturbed_.qdd = s.qdd.replicate(blocks, 1);
  for (int v = 0; v < 3 * n; ++v) {
    Eigen::MatrixXd& part = v < n ? perturbed_.q : v < 2 * n ? perturbed_.qd : perturbed_.qdd;
    part.col(v % n).segment((v + 1) * shape_.samples, shape_.samples).array() += Shift(v);
  }
}

double Objective::operator()(const Eigen::VectorXd& u, Eigen::VectorXd& gradient) {
  const int n = static_cast<int>(unit_.cols()), samples = shape_.samples;
  const codegen::Signals s = Motion(u);
  Perturb(s);
  observation_.Rows(perturbed_, row_);

  Eigen::MatrixXd d_gram, d_torque = Eigen::MatrixXd::Zero(samples, n);
  Adjoint adjoint{d_torque, d_torque, d_torque};
  const double figure = SmoothFigure(d_gram);
  if (!std::isfinite(figure)) return figure;
  const double value = figure + Penalties(s, adjoint) + TorquePenalty(d_torque);

  // Each state variable moves the rows of its own sample only: value's derivative by the rows, times the rows'
  // quotient.
  for (int i = 0; i < n; ++i) {
    const auto here = row_[i].topRows(samples);
    const Eigen::MatrixXd d_row =
        2 * observation_.weight(i) * here * d_gram + d_torque.col(i) * observation_.mean().transpose();
    for (int v = 0; v < 3 * n; ++v) {
      Eigen::MatrixXd& part = v < n ? adjoint.q : v < 2 * n ? adjoint.qd : adjoint.qdd;
      const auto shifted = row_[i].middleRows((v + 1) * samples, samples);
      Eigen::VectorXd change = Eigen::VectorXd::Zero(samples);
      for (Eigen::Index c = 0; c < d_row.cols(); ++c)  // by columns, as they lie in memory
        change += (shifted.col(c) - here.col(c)).cwiseProduct(d_row.col(c));
      part.col(v % n) += change / Shift(v);
    }
  }
  const Eigen::MatrixXd d_coefficient =
      basis_[0].transpose() * adjoint.q + basis_[1].transpose() * adjoint.qd + basis_[2].transpose() * adjoint.qdd;
  const Eigen::MatrixXd d_u = unit_.cwiseProduct(d_coefficient);
  gradient = Eigen::Map<const Eigen::VectorXd>(d_u.data(), d_u.size());
  return value;
}

double Objective::operator()(const Eigen::VectorXd& u) {
  const codegen::Signals s = Motion(u);
  observation_.Rows(s, row_);
  Eigen::MatrixXd d_gram, d_torque = Eigen::MatrixXd::Zero(shape_.samples, unit_.cols());
  Adjoint adjoint{d_torque, d_torque, d_torque};
  const double figure = SmoothFigure(d_gram);
  return std::isfinite(figure) ? figure + Penalties(s, adjoint) + TorquePenalty(d_torque) : figure;
}

}  // namespace armcal::excitation
