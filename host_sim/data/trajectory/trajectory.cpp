// trajectory - reads and writes trajectory files, and computes the clamped cubic spline.
#include "host_sim/data/trajectory/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/csv.hpp"

namespace armcal::trajectory {
namespace {

// 13 digits: second differences over 4 ms magnify rounding by 2.5e5, which leaves 1e-7 rad/s^2.
constexpr int kPositionDigits = 13, kTimeDigits = 12;
constexpr double kStepTolerance = 1e-3;  // of the step; a file that prints t with few digits still passes

std::vector<std::string> Header(int joints) {
  std::vector<std::string> names{"t"};
  for (int j = 1; j <= joints; ++j) names.push_back("q" + std::to_string(j));
  return names;
}

}  // namespace

void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  files::NumericTable table;
  table.names = Header(trajectory.joints());
  table.values.resize(trajectory.q.rows(), trajectory.q.cols() + 1);
  table.values.col(0) = Eigen::VectorXd::LinSpaced(trajectory.q.rows(), 0, trajectory.duration_s());
  table.values.rightCols(trajectory.q.cols()) = trajectory.q;
  std::vector<int> digits(table.names.size(), kPositionDigits);
  digits[0] = kTimeDigits;
  files::WriteCsv(path, table, digits);
}

Trajectory ReadTrajectory(const std::filesystem::path& path, int joints) {
  const files::NumericTable table = files::ReadCsv(path);
  const std::string file = path.string();
  if (table.names != Header(joints))
    throw io::InputError(file + ":1: expected the columns t,q1" + (joints > 1 ? "..q" + std::to_string(joints) : "") +
                         " and no others (armcal excite writes such a file)");
  const Eigen::Index rows = table.values.rows();
  if (rows < kFewestPoints)
    throw io::InputError(file + ": " + std::to_string(rows) + " rows, expected " + std::to_string(kFewestPoints) +
                         " or more");
  Trajectory trajectory;
  const auto t = table.values.col(0);
  trajectory.step_s = (t[rows - 1] - t[0]) / static_cast<double>(rows - 1);
  for (Eigen::Index k = 1; k < rows; ++k)
    if (!(trajectory.step_s > 0 && std::abs(t[k] - t[k - 1] - trajectory.step_s) <= kStepTolerance * trajectory.step_s))
      throw io::InputError(file + ":" + std::to_string(k + 2) +
                           ": column 't': expected time that rises in equal steps");
  trajectory.q = table.values.rightCols(joints);
  return trajectory;
}

// Continuous acceleration at the inner points: m[k-1] + 4 m[k] + m[k+1] = 3 (q[k+1] - q[k-1]), with m the slope per
// step; tridiagonal and dominated by its diagonal, so elimination without pivoting is safe.
TrajectorySpline::TrajectorySpline(const Trajectory& trajectory)
    : step_s_(trajectory.step_s), q_(trajectory.q.transpose()), slope_(Eigen::MatrixXd::Zero(q_.rows(), q_.cols())) {
  const Eigen::Index last = q_.cols() - 1;
  Eigen::VectorXd above(q_.cols());
  above[0] = 0;
  for (Eigen::Index k = 1; k < last; ++k) {
    const double pivot = 4 - above[k - 1];
    above[k] = 1 / pivot;
    slope_.col(k) = (3 * (q_.col(k + 1) - q_.col(k - 1)) - slope_.col(k - 1)) / pivot;
  }
  for (Eigen::Index k = last - 1; k > 0; --k) slope_.col(k) -= above[k] * slope_.col(k + 1);
}

TrajectorySpline::Place TrajectorySpline::Find(double t_s) const {
  const double at = t_s / step_s_, intervals = static_cast<double>(q_.cols() - 1);
  const double inside = std::clamp(at, 0.0, intervals);
  const double interval = std::min(std::floor(inside), intervals - 1);
  return {static_cast<Eigen::Index>(interval), inside - interval, at < 0 || at > intervals};
}

Eigen::VectorXd TrajectorySpline::Position(double t_s) const {
  const auto [k, u, outside] = Find(t_s);
  const double v = 1 - u;
  return v * v * (1 + 2 * u) * q_.col(k) + u * u * (1 + 2 * v) * q_.col(k + 1) + u * v * v * slope_.col(k) -
         u * u * v * slope_.col(k + 1);
}

Eigen::VectorXd TrajectorySpline::Speed(double t_s) const {
  const auto [k, u, outside] = Find(t_s);
  if (outside) return Eigen::VectorXd::Zero(q_.rows());
  return (6 * u * (1 - u) * (q_.col(k + 1) - q_.col(k)) + (1 - u) * (1 - 3 * u) * slope_.col(k) +
          u * (3 * u - 2) * slope_.col(k + 1)) /
         step_s_;
}

Eigen::VectorXd TrajectorySpline::Acceleration(double t_s) const {
  const auto [k, u, outside] = Find(t_s);
  if (outside) return Eigen::VectorXd::Zero(q_.rows());
  return ((6 - 12 * u) * (q_.col(k + 1) - q_.col(k)) + (6 * u - 4) * slope_.col(k) + (6 * u - 2) * slope_.col(k + 1)) /
         (step_s_ * step_s_);
}

}  // namespace armcal::trajectory
