// description - text that several formats have: numbers, names, remarks, and what has no place in a format.
#pragma once

#include "codegen/src/robot/body.hpp"
#include "host_sim/identify/description/described_arm.hpp"

namespace armcal::description {

inline constexpr const char* kInertiaName[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};

// Shortest text that reads back as the same number.
std::string Exact(double v);
std::string Exact(const Eigen::Vector3d& v);
// Fixed-axis roll, pitch and yaw.
Eigen::Vector3d ToRollPitchYaw(const Eigen::Matrix3d& R);

// The numbers of an attribute or element, exactly `count` of them. where: for an error. Throws io::InputError.
std::vector<double> Numbers(const std::string& text, std::size_t count, const std::string& where);
Eigen::Vector3d Three(const std::string& text, const std::string& where);

std::string XmlText(const std::string& text);
std::string XmlComment(std::string text);
// Who wrote the file, and from what.
std::string Remark(const DescribedArm& arm);

bool Slides(const codegen::Joint& joint);
std::string LinkName(const codegen::Robot& robot, std::size_t j);
// Each DH frame at joint position zero: seen from the one before (the first from the base), and from the base.
Eigen::Isometry3d FrameOf(const codegen::Robot& robot, std::size_t j);
Eigen::Isometry3d PoseAtZero(const codegen::Robot& robot, std::size_t j);

// What only a table of this project can hold: effects, torque scales, coupled motors.
std::vector<std::string> Effects(const DescribedArm& arm);
// What neither URDF nor SDF has a place for: these, rotor inertia, and how the arm is mounted.
std::vector<std::string> NotInUrdf(const DescribedArm& arm);

}  // namespace armcal::description
