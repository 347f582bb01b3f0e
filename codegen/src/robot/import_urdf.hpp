// robot - writes a robot file for an arm that a URDF describes.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

// A value that the URDF does not have.
struct Guess {
  std::string joint, key, value, why;  // joint: empty for what holds for the arm; value: with its unit
};

struct ImportedRobot {
  std::string text;  // the robot file
  std::vector<std::string> joints;
  std::vector<Guess> guessed;
  std::vector<std::string> said;  // choices that were made, and what in the URDF cannot be used
  UrdfChoice choice;
};

// name: of the robot, made of what it allows. file: where the robot file will stand; the URDF is named from there.
// The chain is chosen as ChooseChain does. Throws io::InputError with all faults, a line for each: those of ReadUrdf,
// and an arm of more than seven joints. Bodies that are missing, impossible or placeholders are no fault: the file then
// says prior = "none", and `said` says why.
ImportedRobot ImportUrdf(const UrdfChoice& asked, const std::string& name, const std::filesystem::path& file);

}  // namespace armcal::codegen
