// excitation - the largest position, speed, acceleration and torque of a motion, and their shares of the limits.
#pragma once

#include <vector>

#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/identify/collision/clearance.hpp"
#include "host_sim/identify/excitation/observation.hpp"
#include "host_sim/identify/excitation/series.hpp"

namespace armcal::excitation {

inline constexpr double kCheckStep_s = 0.001;  // grid on which limits are checked: a drive's control tick

// What a motion may use: a share of every limit, and the distance that `clearance` asks for. Without clearance,
// collisions are not checked.
struct Limits {
  Limits(double share_of_all, const collision::Clearance* checked = nullptr)
      : share(share_of_all), clearance(checked) {}
  double share;
  const collision::Clearance* clearance;
};

// One joint. Shares: 1 is the limit; the position's share is the distance from the middle of its range.
struct JointPeaks {
  double lowest_rad = 0, highest_rad = 0, speed_radps = 0, acceleration_radps2 = 0, torque_Nm = 0;
  double position_share = 0, speed_share = 0, acceleration_share = 0, torque_share = 0;
};

// Torque by the robot file's values. With prior = "none" it is unknown: torque and its share are 0.
std::vector<JointPeaks> FindPeaks(const Observation& observation, const codegen::Signals& s);

// The largest share of any limit of any joint.
double LargestShare(const std::vector<JointPeaks>& peaks);

// True if it is at most `share`, up to round-off.
bool Keeps(const std::vector<JointPeaks>& peaks, double share);
// The same, and no pair of solids comes too near.
bool Keeps(const Observation& observation, const codegen::Signals& s, const Limits& limits);

// The motion along the spline, on the check grid or any other: q, qd, qdd.
codegen::Signals Sampled(const trajectory::TrajectorySpline& spline, double step_s = kCheckStep_s);

// Reduces the series' amplitude until it keeps the limits on the check grid over one period. Never enlarges it. False:
// even the pose q0 breaks a limit.
bool ScaleToLimits(const Observation& observation, const Limits& limits, Series& series);

}  // namespace armcal::excitation
