// robot - reads a serial chain from a URDF file as modified DH frames.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "codegen/src/io/faults.hpp"
#include "codegen/src/robot/body.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

// A link of the URDF as a part of a moving body.
struct UrdfPart {
  std::string link;
  Eigen::Isometry3d pose;  // the link's own frame, seen from the body's DH frame
  Body body;               // in the link's own axes, centre from its frame; mass 0: the URDF has no inertia for it
};

struct UrdfChain {
  // Outward: name, kinematics, limits, friction ("Fc", "Fv") and the link with all that is fixed to it.
  std::vector<Joint> joint;
  // Why the URDF's position limits cannot be used; empty: they can. position_limit_rad is then not set, or a guess: the
  // URDF's numbers as degrees.
  std::vector<std::string> unlimited;
  // Of each joint: the link that it moves, then all that is fixed to it.
  std::vector<std::vector<UrdfPart>> part;
  std::vector<UrdfPart> base_part;  // what does not move; poses are seen from the root link
  // Collision shapes; those of body 0 are seen from the URDF's root link, the others from the body's DH frame.
  std::vector<Shape> shape;
  // Frame 0 seen from the URDF's root link, and the URDF's last link frame seen from the last DH frame.
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity(), flange = base;
  std::vector<std::string> body_faults;   // a line for each moving body that cannot exist, or is in millimetres
  std::vector<std::string> same_inertia;  // moving links that share mass, centre and inertia: nobody computed these
  std::map<std::string, double> held;     // movable joints that are held, mimic joints among them; rad or m
};

// The URDF's text. A .xacro file, or a file that holds xacro's macros, is expanded by the program `xacro` if there is
// one. Throws io::InputError: no such file; the command to run where `xacro` is missing or fails.
std::string UrdfText(const std::filesystem::path& path);

// What is fixed to each other is one body; what is fixed to the root is left out. Joint positions, their zero and their
// sign are the URDF's. Quarter turns within 1e-5 rad (a URDF prints pi/2 as 1.5708) and offsets below 1e-5 m are taken
// as meant exactly. With a tip, all movable joints that do not lead to it are held at `fixed`, or at zero, or at the
// limit next to zero. A mimic joint is held with the joint that it follows.
// Throws io::InputError with all faults, a line for each with file and joint or link: unreadable, branching, no movable
// joint, a floating, planar or mimic joint, lengths in millimetres.
UrdfChain ReadUrdf(const UrdfChoice& choice);

// Completes what a user has asked for: holds mimic joints and those that they follow, and ends the chain at the
// only longest one. `said`: a line for each choice that was made. Throws io::InputError as ReadUrdf does, and where two
// chains are equally long.
UrdfChoice ChooseChain(const UrdfChoice& asked, std::vector<std::string>& said);

}  // namespace armcal::codegen
