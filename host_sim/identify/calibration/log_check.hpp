// calibration - checks that the samples of a log can be those of one run of this arm, in SI units.
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

inline constexpr double kDegPerRad = 180 / std::numbers::pi;
inline bool Slides(const codegen::Joint& joint) { return joint.kinematics.type == codegen::JointType::kPrismatic; }
inline const char* TorqueUnit(const codegen::Joint& joint) { return Slides(joint) ? "N" : "N m"; }

// What a log says beside its samples. No text names the file.
struct SignalCheck {
  std::vector<std::string> notes;  // worth a line each: what reading left out, gaps, joints at rest
  std::vector<int> resting;        // joints (0-based) whose position never changes
  std::string lack;                // why the log is too little to be fitted alone; empty: it is not
};

// Checks the samples alone against the robot's limits. InputError, one line that names file, joint and problem, where
// - the clock jumps, more than a tenth of the samples are missing, or time has another unit than s: the joints are far
//   slower or faster than their limits, or a logged speed is another one than that of the positions;
// - positions or torques lie far outside of the limits (degrees, mN m);
// - no joint moves; a position jumps, sticks, or rests while its logged speed or command moves;
// - a torque is zero, or does not change while the joint moves.
SignalCheck CheckSignals(const codegen::Robot& robot, const logs::Log& log);

// What these logs, which are fitted or judged together, cannot show: a line for the joints that move and yet have no
// usable row in any of them. InputError: no joint has one; the line names the first log.
std::vector<std::string> CheckRows(const codegen::Robot& robot, const std::vector<const Dataset*>& data);

}  // namespace armcal::calibration
