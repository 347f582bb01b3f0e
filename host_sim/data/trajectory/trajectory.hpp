// trajectory - holds a trajectory: the points of its file and the one curve through them.
#pragma once

#include <Eigen/Core>
#include <filesystem>

namespace armcal::trajectory {

// Joint positions on a uniform grid that starts at t = 0. Starts and ends at rest.
struct Trajectory {
  double step_s = 0.004;
  Eigen::MatrixXd q;  // [points x joints], rad or m

  int joints() const { return static_cast<int>(q.cols()); }
  double duration_s() const { return step_s * static_cast<double>(q.rows() - 1); }
};

inline constexpr int kFewestPoints = 10;

// CSV with the columns t,q1..qn; gzip if the name ends in ".gz"; whole or not at all. InputError: cannot be written.
void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory);

// joints: how many the robot has. InputError with file and what was expected: other columns than t,q1..qn, a number
// that is not finite, fewer than kFewestPoints rows, time that does not rise in equal steps.
Trajectory ReadTrajectory(const std::filesystem::path& path, int joints);

// What every player moves along between the points: the cubic spline with continuous acceleration whose speed is zero
// at both ends. On a smooth motion of angular frequency w its acceleration errs by (w step)^2 / 12 of the true one.
class TrajectorySpline {
 public:
  // At least two points, step_s > 0.
  explicit TrajectorySpline(const Trajectory& trajectory);

  int joints() const { return static_cast<int>(q_.rows()); }
  double duration_s() const { return step_s_ * static_cast<double>(q_.cols() - 1); }

  // [joints] at time t_s; before the start and after the end the ends, at rest.
  Eigen::VectorXd Position(double t_s) const;
  Eigen::VectorXd Speed(double t_s) const;
  Eigen::VectorXd Acceleration(double t_s) const;

 private:
  struct Place {
    Eigen::Index interval;
    double u;      // 0..1 within it
    bool outside;  // before the start or after the end
  };
  Place Find(double t_s) const;

  double step_s_;
  Eigen::MatrixXd q_, slope_;  // [joints x points]; slope per step, not per second
};

}  // namespace armcal::trajectory
