// robot - reads a serial chain from a URDF file as modified DH frames.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

struct UrdfChain {
  // Outward: name, kinematics, limits, friction ("Fc", "Fv") and the link with all that is fixed to it.
  std::vector<Joint> joint;
  std::vector<bool> limited;  // false: a continuous joint, position_limit_rad is not set
  // Frame 0 seen from the URDF's root link, and the URDF's last link frame seen from the last DH frame.
  Eigen::Isometry3d base, flange;
};

// What is fixed to each other is one body; what is fixed to the root is left out. Joint positions, their zero and their
// sign are the URDF's. Quarter turns within 1e-5 rad (a URDF prints pi/2 as 1.5708) and offsets below 1e-5 m are taken
// as meant exactly.
// Throws io::InputError, one line with file and joint or link: unreadable, branching, no movable joint, a floating,
// planar or mimic joint.
UrdfChain ReadUrdf(const std::filesystem::path& path);

}  // namespace armcal::codegen
