// robot - one [[joint]] table of a robot file; knows no other table.
#pragma once

#include <numbers>

#include "codegen/src/io/toml_reader.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// A whole joint with its DH row and, if the file has a prior, its link.
Joint ReadJoint(const io::TomlReader& in, bool has_prior);

// What the table says beside kinematics and body. limited: the joint has position limits already; those and any limit
// above zero may be absent here, and are replaced where they are not.
void ReadDrive(const io::TomlReader& in, Joint& joint, bool limited);
void AllowDriveKeys(const io::TomlReader& in);

}  // namespace armcal::codegen
