// calibration - checks a log against the torque that the robot file's bodies need.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// An arm without a prior passes. InputError: two columns are exchanged, or a torque has another unit or sign. Returns a
// line for people if the torques are much smaller or larger than the bodies need.
std::vector<std::string> CheckAgainstModel(const codegen::Model& model, const Dataset& data);

}  // namespace armcal::calibration
