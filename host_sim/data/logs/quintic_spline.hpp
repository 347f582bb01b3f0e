// logs - puts a quintic spline through the samples of several signals, and gives its derivatives.
#pragma once

#include <Eigen/Core>

namespace armcal::logs {

// C4 spline of degree 5 through (t[k], y.row(k)) with the not-a-knot end rule. On a uniform grid of step h its second
// derivative errs by (w h)^4 / 720 of the true one, where central differences err by (w h)^2 / 12.
class QuinticSpline {
 public:
  static constexpr Eigen::Index kMinSamples = 8;

  // t: [N] strictly rising, N >= kMinSamples; y: [N x signals]. Cost: linear in N.
  QuinticSpline(const Eigen::VectorXd& t, const Eigen::MatrixXd& y);

  // Derivative `order` (0, 1 or 2) at the times `at` (rising, within the samples' span): [at.size() x signals].
  Eigen::MatrixXd Evaluate(const Eigen::VectorXd& at, int order) const;

 private:
  Eigen::VectorXd knot_;       // [N + 6], first and last six times over
  Eigen::MatrixXd weight_[3];  // B-spline weights of the spline, its first and its second derivative
};

}  // namespace armcal::logs
