// excitation - what a Fourier series is optimised for: log of a smooth cond(K) and penalties on the limits, with
// gradient. Knows no search.
#pragma once

#include <Eigen/Core>

#include "host_sim/excitation/fourier.hpp"
#include "host_sim/excitation/observation.hpp"

namespace armcal::excitation {

struct SeriesShape {
  double frequency_radps = 0.62831853071795865;  // w = 2 pi 0.1 rad/s: period 10 s, as in the survey
  int harmonics = 5;
  int samples = 80;  // of one period, at which K is looked at; a model with exponentials needs 250 or more
};

// Unknowns u: the series' coefficients, joint after joint, in units of what the joint's limits allow (order 1).
// It keeps its working memory: one objective a thread.
class Objective {
 public:
  // share: how much of each limit may be used (1 - margin). The observation must outlive the objective.
  Objective(const Observation& observation, const SeriesShape& shape, double share);

  int size() const { return static_cast<int>(unit_.size()); }
  Fourier Series(const Eigen::VectorXd& u) const;

  // (1/p) (log sum s^p + log sum s^-p), s the singular values of the scaled K, p = 10: log cond(K) from above within
  // 2 log(columns) / p. Plus quadratic penalties on position, speed, acceleration, torque. Infinite if K is singular.
  double operator()(const Eigen::VectorXd& u, Eigen::VectorXd& gradient);

 private:
  struct Adjoint {
    Eigen::MatrixXd q, qd, qdd;  // d value / d state, [samples x joints]
  };
  double LogCondition(Eigen::MatrixXd& d_gram) const;
  double Penalties(const codegen::Signals& s, Adjoint& adjoint) const;
  double TorquePenalty(Eigen::MatrixXd& d_torque) const;
  void Perturb(const codegen::Signals& s);
  double Shift(int variable) const;

  const Observation& observation_;
  SeriesShape shape_;
  double share_;
  Eigen::VectorXd t_;
  Eigen::MatrixXd basis_[3];     // derivative 0, 1, 2
  Eigen::MatrixXd unit_, zero_;  // coefficient = zero + unit * u, [2 L + 1 x joints]
  codegen::Signals perturbed_;
  std::vector<Eigen::MatrixXd> row_;  // of the perturbed motion; the first `samples` rows are the motion's own
};

}  // namespace armcal::excitation
