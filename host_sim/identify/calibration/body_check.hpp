// calibration - checks a log against the torque that the robot file's bodies need.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// An arm without a prior passes. InputError: two columns are exchanged, or a torque has another unit or sign.
void CheckAgainstModel(const codegen::Model& model, const Dataset& data);

}  // namespace armcal::calibration
