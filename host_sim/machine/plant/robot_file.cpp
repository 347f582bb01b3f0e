// plant - reads a robot file.
#include "host_sim/machine/plant/robot_file.hpp"

#include <algorithm>
#include <cstdint>

#include "codegen/src/io/toml_reader.hpp"
#include "host_sim/machine/plant/frame_keys.hpp"

namespace armcal::plant {
namespace {

Body ReadBody(const io::TomlReader& link) {
  Body body;
  body.mass_kg = link.Positive("mass_kg");
  const auto center = link.Numbers("center_m", 3);
  const auto inertia = link.Numbers("inertia_kgm2", 6);
  std::copy(center.begin(), center.end(), body.center_m.begin());
  std::copy(inertia.begin(), inertia.end(), body.inertia_kgm2.begin());
  return body;
}

void ReadMotor(const io::TomlReader& encoder, const io::TomlReader& motor, JointData& joint) {
  joint.counts_per_turn = encoder.Positive("counts_per_turn");
  joint.zero_counts = encoder.Integer("zero_counts", INT32_MIN, INT32_MAX, 0);
  joint.gear_ratio = motor.Number("gear_ratio");
  if (joint.gear_ratio == 0) motor.Fail("gear_ratio", "a signed ratio, not 0");
  joint.current_A_per_lsb = motor.Positive("current_A_per_lsb");
  joint.torque_constant_NmpA = motor.Positive("torque_constant_NmpA");
  joint.rotor_inertia_kgm2 = motor.NotNegative("rotor_inertia_kgm2", 0);
}

JointData ReadJoint(const io::TomlReader& keys) {
  JointData joint;
  joint.name = keys.Text("name");
  const std::string type = keys.Text("type");
  if (type != "revolute" && type != "prismatic") keys.Fail("type", "\"revolute\" or \"prismatic\"");
  const bool prismatic = joint.prismatic = type == "prismatic";
  joint.alpha_rad = keys.Number("alpha_deg") * kRadPerDeg;
  joint.a_m = keys.Number("a_m");
  joint.d_m = keys.Number("d_m") + (prismatic ? keys.Number("offset_m", 0) : 0);
  joint.theta_rad = keys.Number("offset_deg", 0) * kRadPerDeg;
  joint.torque_limit_Nm = keys.Positive(prismatic ? "torque_limit_N" : "torque_limit_Nm");
  joint.torque_noise_Nm = keys.NotNegative(prismatic ? "torque_noise_N" : "torque_noise_Nm");
  joint.coulomb_Nm = keys.NotNegative(prismatic ? "coulomb_N" : "coulomb_Nm", 0);
  joint.viscous_Nmsprad = keys.NotNegative(prismatic ? "viscous_Nspm" : "viscous_Nmsprad", 0);
  ReadMotor(keys.Table("encoder"), keys.Table("motor"), joint);
  joint.body = ReadBody(keys.Table("link"));
  return joint;
}

// Standard DH puts (a_i, alpha_i) after joint i. Read as modified DH they come before joint i+1, so every row moves one
// joint up; a link frame is then at its own joint's axis, and the last row leads from the last link to the flange.
void ShiftStandardDh(RobotFile& robot) {
  double alpha = 0, a = 0;
  for (JointData& joint : robot.joint) {
    std::swap(alpha, joint.alpha_rad);
    std::swap(a, joint.a_m);
  }
  robot.tool_frame = KDL::Frame::DH_Craig1989(a, alpha, 0, 0) * robot.tool_frame;
}

// The last link and what is clamped to its flange as one body.
void Carry(RobotFile& robot, const Body& payload) {
  Body& link = robot.joint.back().body;
  KDL::RigidBodyInertia both = ToKdl(link) + robot.tool_frame * ToKdl(payload);
  const KDL::Vector c = both.getCOG();
  const auto about_centre = both.RefPoint(c).getRotationalInertia();
  const double* I = about_centre.data;
  link = {both.getMass(), {c.x(), c.y(), c.z()}, {I[0], I[1], I[2], I[4], I[5], I[8]}};
}

}  // namespace

KDL::RigidBodyInertia ToKdl(const Body& body) {
  const auto& c = body.center_m;
  const auto& i = body.inertia_kgm2;
  return KDL::RigidBodyInertia(body.mass_kg, KDL::Vector(c[0], c[1], c[2]),
                               KDL::RotationalInertia(i[0], i[3], i[5], i[1], i[2], i[4]));
}

RobotFile ReadRobotFile(const std::string& path) {
  const toml::table table = io::ParseToml(path);
  const io::TomlReader keys(table, path);
  RobotFile robot;
  robot.path = path;
  robot.name = keys.Text("name");
  const auto gravity = keys.Numbers("gravity_mps2", 3);
  robot.gravity_mps2 = KDL::Vector(gravity[0], gravity[1], gravity[2]);
  robot.tick_rate_Hz = keys.Positive("tick_rate_Hz", 1000);
  if (keys.Has("base_frame")) robot.base_frame = ReadFrame(keys.Table("base_frame"));
  if (keys.Has("tool_frame")) robot.tool_frame = ReadFrame(keys.Table("tool_frame"));
  for (const io::TomlReader& joint : keys.Tables("joint")) robot.joint.push_back(ReadJoint(joint));
  if (robot.joint.empty()) keys.Fail("joint", "at least one [[joint]]");
  const std::string dh = keys.Text("dh");
  if (dh != "modified" && dh != "standard") keys.Fail("dh", "\"modified\" or \"standard\"");
  if (dh == "standard") ShiftStandardDh(robot);
  if (keys.Has("payload")) Carry(robot, ReadBody(keys.Table("payload")));
  const int n = robot.joints();
  robot.coupling = Eigen::MatrixXd::Identity(n, n);
  if (keys.Has("coupling")) {
    const auto values = keys.Table("coupling").Numbers("matrix", static_cast<std::size_t>(n) * n);
    for (int i = 0; i < n * n; ++i) robot.coupling(i / n, i % n) = values[static_cast<std::size_t>(i)];
  }
  return robot;
}

}  // namespace armcal::plant
