// calibration - whether a log can be what it says it is: one run of this arm, in SI units, column by column; knows no
// method.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// From the samples alone and the robot's limits. InputError, one line naming file, joint and problem: a log shorter
// than 3 s, a clock that jumps, more than a tenth of the samples missing, positions or torques far outside of the
// limits (degrees, mN m), a position that jumps or sticks, a torque that is zero or does not change while the joint
// moves. Returns what is worth a line but no refusal: gaps.
std::vector<std::string> CheckSignals(const codegen::Robot& robot, const logs::Log& log);

// Against the torque that the robot file's bodies need (arms with a prior): InputError where two columns are
// exchanged, or a torque has another unit or sign.
void CheckAgainstModel(const codegen::Model& model, const Dataset& data);

}  // namespace armcal::calibration
