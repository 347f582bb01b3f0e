// calibration - which faults of a log's columns no fit can see while the arm's bodies are free.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::calibration {

// Faults that leave an arm of the same kinematics with other bodies: each in words, "an offset of q1". Found at random
// states within the robot's limits: torques of the wrong columns that some other parameters give exactly. Looked at:
// an offset of each position, one factor of a torque or of all, signs of joints (position and torque together, since
// friction shows one alone), exchanged joints, another unit of time.
// Empty if the robot file has link data.
std::vector<std::string> UntoldFaults(const codegen::Model& model);

}  // namespace armcal::calibration
