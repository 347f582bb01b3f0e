// plant - reads the arm of a URDF: the joints that move, and the bodies between them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "host_sim/machine/plant/robot_file.hpp"

namespace armcal::plant {

struct UrdfArm {
  // Given: the file, the joints that move, positions of joints that do not (rad, m), and the link at which the arm ends
  // (empty: the last one that moves).
  std::string file, tip;
  std::set<std::string> moving;
  std::map<std::string, double> fixed;
  // Found, outward: name, kind, place, limits, friction and body of each joint. Bodies are in the axes of the URDF's
  // link; what is fixed to a link, or held, is a part of it.
  std::vector<JointData> joint;
  KDL::Frame flange;  // the tip's frame, seen from the last link that moves
};

// Throws io::InputError (file, joint or link, what was expected).
void ReadUrdfArm(UrdfArm& arm);

}  // namespace armcal::plant
