// description - the bodies of a file that has link frames of its own, beside those of the arm.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/robot/body.hpp"
#include "host_sim/identify/description/described_arm.hpp"

namespace armcal::description {

// A link of the file, and what it weighs, in its own frame. pose: in the file's world, all joints at zero.
struct FilePart {
  std::string link;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  codegen::Body body;
};

// A joint of the arm as the file has it, and the links that it moves; the joint's own link comes first.
struct FileJoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::Zero();  // in the file's world
  bool slides = false;
  std::vector<FilePart> part;
};

// The arm's base frame, seen from the file's world: all axes of the file lie on those of the arm then. `joint` are the
// arm's. Throws io::InputError: a joint of another type, or axes that differ by more than 1 mm or 1 mrad.
Eigen::Isometry3d BaseInFile(const DescribedArm& arm, const std::vector<FileJoint>& joint, const std::string& file);

// What the joint's own link is left with when all else that the joint moves keeps what it weighs; in the link's frame.
// body: in the joint's DH frame, which stands at dh_frame where the links stand at their poses. whole: the link gets
// all of it.
codegen::Body RestOf(const codegen::Link& body, const Eigen::Isometry3d& dh_frame, const FileJoint& joint, bool whole);

// Empty, or the line that says why the rest cannot exist. remedy: the end of it.
std::string WhyNoRest(const codegen::Body& rest, const FileJoint& joint, const std::string& file,
                      const std::string& remedy = "--merge writes the whole body into it");

}  // namespace armcal::description
