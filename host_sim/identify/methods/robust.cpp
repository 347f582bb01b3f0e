// methods - least squares with weights that reject outliers: Huber, then bisquare.
//
// A row's weight falls with its residual, counted in robust standard deviations of its joint: median absolute deviation
// / 0.6745, but never below the stated torque noise. Huber's weights (1.345) are convex and find the minimum. Tukey's
// bisquare (4.685) then gives outliers no weight at all. Both are 95 % efficient on Gaussian noise.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_sim/data/logs/steps.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kHuber = 1.345, kBisquare = 4.685;
constexpr int kHuberRounds = 15, kAllRounds = 40;

double Weight(double x, bool bisquare) {
  if (!bisquare) return x <= kHuber ? 1 : kHuber / x;
  if (x >= kBisquare) return 0;
  const double r = x / kBisquare;
  return (1 - r * r) * (1 - r * r);
}

// Per joint, of whitened residuals.
VectorXd RobustScale(const Linearised& rows, int joints) {
  std::vector<std::vector<double>> size(static_cast<std::size_t>(joints));
  for (Eigen::Index r = 0; r < rows.residual.size(); ++r) size[rows.joint[r]].push_back(std::abs(rows.residual[r]));
  VectorXd scale = VectorXd::Ones(joints);
  for (int j = 0; j < joints; ++j) {
    if (size[j].empty()) continue;
    scale[j] = std::max(1.0, logs::Median(std::move(size[j])) / 0.6745);
  }
  return scale;
}

}  // namespace

Solution Robust(const Problem& problem) {
  const double began = CpuSeconds();
  Solution solution;
  VectorXd z = problem.start;
  ClampEta(problem, z);
  const bool linear = problem.model->nonlinear() == 0 && !problem.model->depends_on_estimate();
  Linearised rows = Linearise(problem, z);
  VectorXd root = VectorXd::Ones(rows.residual.size());  // of the weights; the first round is plain least squares
  solution.converged = false;
  bool bisquare = false;
  for (; solution.iterations < kAllRounds && !solution.converged && !Stopped(problem); ++solution.iterations) {
    const MatrixXd A = root.asDiagonal() * rows.A;
    const VectorXd target = root.cwiseProduct(rows.residual + rows.A * z);
    VectorXd next = SolveRegularised(problem, A.transpose() * A, A.transpose() * target, &solution.covariance);
    ClampEta(problem, next);
    double change = 0;
    for (Eigen::Index c = 0; c < z.size(); ++c)
      if (solution.covariance(c, c) > 0)
        change = std::max(change, std::abs(next[c] - z[c]) / std::sqrt(solution.covariance(c, c)));
    solution.converged = change < kSettled && bisquare;
    bisquare = bisquare || change < kSettled || solution.iterations + 1 >= kHuberRounds;
    if (linear) rows.residual -= rows.A * (next - z);
    else rows = Linearise(problem, next);
    z = next;
    const VectorXd scale = RobustScale(rows, problem.model->joints());
    for (Eigen::Index r = 0; r < root.size(); ++r)
      root[r] = std::sqrt(Weight(std::abs(rows.residual[r]) / scale[rows.joint[r]], bisquare)) / scale[rows.joint[r]];
    if (problem.progress) problem.progress(static_cast<double>(solution.iterations + 1) / kAllRounds, change);
  }
  solution.z = z;
  const auto left_out = (root.array() == 0).count();
  solution.remark = fmt::format("{:.2f} % of the rows got no weight",
                                100.0 * static_cast<double>(left_out) / static_cast<double>(root.size()));
  if (!solution.converged) solution.remark += "; stopped before the last step was small";
  solution.memory_bytes = 2 * static_cast<std::size_t>(rows.A.size()) * sizeof(double);
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
