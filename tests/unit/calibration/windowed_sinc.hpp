// calibration tests - what a logger does to each column before it keeps fewer samples: a zero-phase low-pass that is
// far steeper than a drive or a gear.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace armcal::tests {

// Shape as x, [N x columns]. Outside the log x counts as 0.
inline Eigen::MatrixXd WindowedSinc(const Eigen::MatrixXd& x, double edge_Hz, double rate_Hz) {
  constexpr Eigen::Index kReach = 200;
  Eigen::VectorXd weight(2 * kReach + 1);
  for (Eigen::Index i = -kReach; i <= kReach; ++i) {
    const double at = static_cast<double>(i), turns = edge_Hz * at / rate_Hz,
                 window = std::pow(std::cos(0.5 * std::numbers::pi * at / (kReach + 1.0)), 2);
    const double sinc =
        i == 0 ? 2 * edge_Hz / rate_Hz : std::sin(2 * std::numbers::pi * turns) / (std::numbers::pi * at);
    weight[kReach + i] = sinc * window;
  }
  Eigen::MatrixXd y(x.rows(), x.cols());
  for (Eigen::Index k = 0; k < x.rows(); ++k) {
    const Eigen::Index first = std::max<Eigen::Index>(0, k - kReach), end = std::min(x.rows(), k + kReach + 1);
    y.row(k) = weight.segment(first - k + kReach, end - first).transpose() * x.middleRows(first, end - first);
  }
  return y;
}

}  // namespace armcal::tests
