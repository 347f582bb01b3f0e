// description - text that several formats have.
#include "host_sim/identify/description/file_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/frames.hpp"

namespace armcal::description {

namespace {

using codegen::Joint;
using codegen::JointType;

std::vector<std::string> Rotors(const DescribedArm& arm) {
  std::vector<std::string> out;
  for (std::size_t j = 0; j < arm.joint.size(); ++j)
    if (arm.joint[j].rotor_kgm2 > 0)
      out.push_back(fmt::format("rotor inertia of {} = {:.6g} {}", arm.robot.joint[j].name, arm.joint[j].rotor_kgm2,
                                Slides(arm.robot.joint[j]) ? "kg" : "kg*m^2"));
  return out;
}

}  // namespace

std::string Exact(double v) { return fmt::format("{}", v == 0 ? 0.0 : v); }
std::string Exact(const Eigen::Vector3d& v) { return Exact(v[0]) + " " + Exact(v[1]) + " " + Exact(v[2]); }

Eigen::Vector3d ToRollPitchYaw(const Eigen::Matrix3d& R) {
  const double level = std::hypot(R(0, 0), R(1, 0));
  if (level < 1e-12) return {std::atan2(-R(1, 2), R(1, 1)), std::atan2(-R(2, 0), level), 0};
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), level), std::atan2(R(1, 0), R(0, 0))};
}

std::vector<double> Numbers(const std::string& text, std::size_t count, const std::string& where) {
  std::vector<double> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (true) {
    while (at != end && space(*at)) ++at;
    if (at != end && *at == '+') ++at;
    double value = 0;
    const auto [behind, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) break;
    out.push_back(value), at = behind;
  }
  if (at != end || out.size() != count)
    throw io::InputError(fmt::format("{}: expected {} numbers, not \"{}\"", where, count, text));
  return out;
}

Eigen::Vector3d Three(const std::string& text, const std::string& where) {
  return Eigen::Vector3d(Numbers(text, 3, where).data());
}

std::string XmlText(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '&'   ? std::string("&amp;")
           : c == '<' ? std::string("&lt;")
           : c == '"' ? std::string("&quot;")
                      : std::string(1, c);
  return out;
}

std::string XmlComment(std::string text) {  // no comment of XML holds two hyphens
  for (auto at = text.find("--"); at != text.npos; at = text.find("--", at)) text.replace(at, 2, "- -");
  return "<!-- " + text + " -->";
}

std::string Remark(const DescribedArm& arm) {
  return fmt::format("{}: written by armcal export from {}. Link frames are modified DH frames.", arm.robot.name,
                     arm.source);
}

bool Slides(const Joint& joint) { return joint.kinematics.type == JointType::kPrismatic; }

std::string LinkName(const codegen::Robot& robot, std::size_t j) { return robot.joint[j].name + "_link"; }

Eigen::Isometry3d FrameOf(const codegen::Robot& robot, std::size_t j) {
  const Eigen::Isometry3d row = codegen::ModifiedDh(robot.joint[j].kinematics);
  return j == 0 ? codegen::ToPose(robot.base_xyz_m, robot.base_rotation) * row : row;
}

Eigen::Isometry3d PoseAtZero(const codegen::Robot& robot, std::size_t j) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t k = 0; k <= j; ++k) T = T * FrameOf(robot, k);
  return T;
}

std::vector<std::string> Effects(const DescribedArm& arm) {
  std::vector<std::string> out;
  for (const Value& v : arm.effect) out.push_back(fmt::format("{} = {:.6g} {}", v.name, v.value, v.unit));
  for (std::size_t j = 0; j < arm.joint.size(); ++j)
    if (arm.joint[j].torque_scale != 1)
      out.push_back(fmt::format("torque scale of {} = {:.6g}", arm.robot.joint[j].name, arm.joint[j].torque_scale));
  if (!arm.robot.coupling.empty()) out.push_back("the coupling of the motors");
  return out;
}

std::vector<std::string> NotInUrdf(const DescribedArm& arm) {
  std::vector<std::string> out = Rotors(arm);
  for (const std::string& line : Effects(arm)) out.push_back(line);
  const auto& g = arm.robot.gravity_mps2;
  if (g[0] != 0 || g[1] != 0 || g[2] > 0)
    out.push_back(
        fmt::format("the mounting: gravity is [{:.6g}, {:.6g}, {:.6g}] m/s^2 in the base frame", g[0], g[1], g[2]));
  return out;
}

}  // namespace armcal::description
