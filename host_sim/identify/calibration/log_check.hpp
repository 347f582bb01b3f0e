// calibration - checks that a log is what it says it is: one run of this arm, in SI units, with each column in place.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// Checks the samples alone against the robot's limits. Returns remarks that are worth a line: gaps. InputError, one
// line that names file, joint and problem, where
// - the log is shorter than 3 s, its clock jumps, or more than a tenth of its samples are missing;
// - positions or torques lie far outside of the limits (degrees, mN m);
// - a position jumps or sticks;
// - a torque is zero, or does not change while the joint moves.
std::vector<std::string> CheckSignals(const codegen::Robot& robot, const logs::Log& log);

// Checks a log against the torque that the robot file's bodies need; an arm without a prior passes. InputError: two
// columns are exchanged, or a torque has another unit or sign.
void CheckAgainstModel(const codegen::Model& model, const Dataset& data);

}  // namespace armcal::calibration
