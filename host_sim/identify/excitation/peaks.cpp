// excitation - finds the peaks of a motion, and reduces a series until it keeps the limits.
#include "host_sim/identify/excitation/peaks.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::excitation {

std::vector<JointPeaks> FindPeaks(const Observation& observation, const codegen::Signals& s) {
  const codegen::Robot& robot = observation.model().robot();
  Eigen::MatrixXd torque = Eigen::MatrixXd::Zero(s.q.rows(), robot.joints());
  if (robot.has_prior) torque = observation.Torque(s);
  std::vector<JointPeaks> peaks(robot.joints());
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const auto [low, high] = joint.position_limit_rad;
    const double middle = (low + high) / 2, half = (high - low) / 2;
    JointPeaks& p = peaks[j];
    p.lowest_rad = s.q.col(j).minCoeff();
    p.highest_rad = s.q.col(j).maxCoeff();
    p.speed_radps = s.qd.col(j).cwiseAbs().maxCoeff();
    p.acceleration_radps2 = s.qdd.col(j).cwiseAbs().maxCoeff();
    p.torque_Nm = torque.col(j).cwiseAbs().maxCoeff();
    p.position_share = std::max(p.highest_rad - middle, middle - p.lowest_rad) / half;
    p.speed_share = p.speed_radps / joint.speed_limit_radps;
    p.acceleration_share = p.acceleration_radps2 / joint.acceleration_limit_radps2;
    p.torque_share = p.torque_Nm / joint.torque_limit_Nm;
  }
  return peaks;
}

double LargestShare(const std::vector<JointPeaks>& peaks) {
  double share = 0;
  for (const JointPeaks& p : peaks)
    share = std::max({share, p.position_share, p.speed_share, p.acceleration_share, p.torque_share});
  return share;
}

// The tolerance is needed because some poses lie exactly at the edge of what `share` allows.
bool Keeps(const std::vector<JointPeaks>& peaks, double share) { return LargestShare(peaks) <= share * (1 + 1e-9); }

bool Keeps(const Observation& observation, const codegen::Signals& s, const Limits& limits) {
  return Keeps(FindPeaks(observation, s), limits.share) && (!limits.clearance || limits.clearance->Keeps(s.q));
}

codegen::Signals Sampled(const trajectory::TrajectorySpline& spline, double step_s) {
  const auto points = static_cast<Eigen::Index>(std::floor(spline.duration_s() / step_s + 1e-6)) + 1;
  codegen::Signals s;
  s.t = Eigen::VectorXd::LinSpaced(points, 0, step_s * static_cast<double>(points - 1));
  s.q.resize(points, spline.joints()), s.qd = s.qdd = s.q;
  for (Eigen::Index k = 0; k < points; ++k) {
    s.q.row(k) = spline.Position(s.t[k]);
    s.qd.row(k) = spline.Speed(s.t[k]);
    s.qdd.row(k) = spline.Acceleration(s.t[k]);
  }
  return s;
}

bool ScaleToLimits(const Observation& observation, const Limits& limits, Series& series) {
  const codegen::Robot& robot = observation.model().robot();
  const double share = limits.share;
  const auto points = static_cast<Eigen::Index>(std::ceil(series.period_s / kCheckStep_s));
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(points, 0, kCheckStep_s * static_cast<double>(points - 1));
  const auto keeps = [&](double factor) { return Keeps(observation, series.Scaled(factor).At(t), limits); };

  // Position, speed and acceleration are linear in the amplitude, so their factor follows from one evaluation.
  double factor = 1;
  const std::vector<JointPeaks> peaks = FindPeaks(observation, series.At(t));
  for (int j = 0; j < robot.joints(); ++j) {
    const auto [low, high] = robot.joint[j].position_limit_rad;
    const double q0 = series.offset()[j], half = (high - low) / 2;
    const double room_up = (low + high) / 2 + share * half - q0, room_down = q0 - (low + high) / 2 + share * half;
    if (room_up <= 0 || room_down <= 0) return false;
    const JointPeaks& p = peaks[j];
    factor = std::min({factor, room_up / std::max(p.highest_rad - q0, room_up),
                       room_down / std::max(q0 - p.lowest_rad, room_down), share / std::max(p.speed_share, share),
                       share / std::max(p.acceleration_share, share)});
  }
  // Torque is not linear, because of gravity, and distances are not linear either. So the bracket is halved: 12 steps
  // leave 1/4000 of the amplitude.
  if (!keeps(factor)) {
    if (!keeps(0)) return false;
    double good = 0, bad = factor;
    for (int k = 0; k < 12; ++k) {
      const double middle = (good + bad) / 2;
      (keeps(middle) ? good : bad) = middle;
    }
    factor = good;
  }
  series = series.Scaled(factor);
  return true;
}

}  // namespace armcal::excitation
