// plant - reads a robot file.
#include "host_sim/machine/plant/robot_file.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>

#include "codegen/src/io/toml_reader.hpp"
#include "host_sim/machine/plant/frame_keys.hpp"
#include "host_sim/machine/plant/urdf_arm.hpp"

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

void ReadMotor(const io::TomlReader& keys, JointData& joint) {
  if (!keys.Has("motor")) {
    joint.counts_per_turn = joint.prismatic ? 2e7 * std::numbers::pi : 0x1p23;
    joint.torque_constant_NmpA = 1;
    joint.current_A_per_lsb = joint.torque_limit_Nm / 0x1p14;
    return;
  }
  joint.has_motor = true;
  const io::TomlReader encoder = keys.Table("encoder"), motor = keys.Table("motor");
  joint.counts_per_turn = encoder.Positive("counts_per_turn");
  joint.zero_counts = encoder.Integer("zero_counts", INT32_MIN, UINT32_MAX, 0);
  joint.gear_ratio = motor.Number("gear_ratio");
  if (joint.gear_ratio == 0) motor.Fail("gear_ratio", "a signed ratio, not 0");
  joint.current_A_per_lsb = motor.Positive("current_A_per_lsb");
  joint.torque_constant_NmpA = motor.Positive("torque_constant_NmpA");
  joint.rotor_inertia_kgm2 = motor.NotNegative("rotor_inertia_kgm2", 0);
  joint.rotor_stated = motor.Has("rotor_inertia_kgm2");
}

// Numbers of the table stand before those that the joint has of a URDF.
void ReadDrive(const io::TomlReader& keys, JointData& joint) {
  const bool slide = joint.prismatic;
  const char* const position = slide ? "position_limit_m" : "position_limit_deg";
  const char* const torque = slide ? "torque_limit_N" : "torque_limit_Nm";
  if (keys.Has(position)) {
    const auto limits = keys.Numbers(position, 2);
    joint.lowest_rad = limits[0] * (slide ? 1 : kRadPerDeg), joint.highest_rad = limits[1] * (slide ? 1 : kRadPerDeg);
  }
  if (keys.Has("speed_limit_mps")) joint.speed_limit_radps = keys.Positive("speed_limit_mps");
  if (keys.Has("speed_limit_degps")) joint.speed_limit_radps = keys.Positive("speed_limit_degps") * kRadPerDeg;
  if (!(joint.torque_limit_Nm > 0) || keys.Has(torque)) joint.torque_limit_Nm = keys.Positive(torque);
  joint.torque_noise_Nm = keys.NotNegative(slide ? "torque_noise_N" : "torque_noise_Nm");
  const char* const coulomb = slide ? "coulomb_N" : "coulomb_Nm";
  const char* const viscous = slide ? "viscous_Nspm" : "viscous_Nmsprad";
  joint.coulomb_Nm = keys.NotNegative(coulomb, joint.coulomb_Nm);
  joint.viscous_Nmsprad = keys.NotNegative(viscous, joint.viscous_Nmsprad);
  joint.coulomb_stated = keys.Has(coulomb), joint.viscous_stated = keys.Has(viscous);
  ReadMotor(keys, joint);
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
  ReadDrive(keys, joint);
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
  robot.tool_frame = KDL::Frame::DH_Craig1989(a, alpha, 0, 0);
}

// The joints that have a table, in the URDF's order.
void ReadUrdfJoints(const io::TomlReader& keys, RobotFile& robot) {
  UrdfArm arm;
  arm.file = (std::filesystem::path(keys.file()).parent_path() / keys.Text("urdf")).string();
  arm.tip = keys.Text("tip", "");
  const std::vector<io::TomlReader> tables = keys.Tables("joint");
  for (const io::TomlReader& table : tables) arm.moving.insert(table.Text("name"));
  if (keys.Has("fixed")) {
    const io::TomlReader fixed = keys.Table("fixed");
    for (const auto& [name, value] : fixed.table()) arm.fixed[std::string(name.str())] = fixed.Number(name.str());
  }
  ReadUrdfArm(arm);
  robot.tool_frame = arm.flange;
  for (JointData& joint : arm.joint)
    for (const io::TomlReader& table : tables)
      if (table.Text("name") == joint.name) ReadDrive(table, joint), robot.joint.push_back(joint);
}

// The last link and what is clamped to its flange as one body.
void Carry(RobotFile& robot, const Body& payload) {
  Body& link = robot.joint.back().body;
  link = FromKdl(ToKdl(link) + robot.tool_frame * ToKdl(payload));
}

}  // namespace

KDL::RigidBodyInertia ToKdl(const Body& body) {
  const auto& c = body.center_m;
  const auto& i = body.inertia_kgm2;
  return KDL::RigidBodyInertia(body.mass_kg, KDL::Vector(c[0], c[1], c[2]),
                               KDL::RotationalInertia(i[0], i[3], i[5], i[1], i[2], i[4]));
}

Body FromKdl(KDL::RigidBodyInertia body) {
  const KDL::Vector c = body.getCOG();
  const auto about_centre = body.RefPoint(c).getRotationalInertia();
  const double* I = about_centre.data;
  return {body.getMass(), {c.x(), c.y(), c.z()}, {I[0], I[1], I[2], I[4], I[5], I[8]}};
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
  const KDL::Frame tool = keys.Has("tool_frame") ? ReadFrame(keys.Table("tool_frame")) : KDL::Frame();
  if (keys.Has("urdf")) {
    ReadUrdfJoints(keys, robot);
  } else {
    for (const io::TomlReader& joint : keys.Tables("joint")) robot.joint.push_back(ReadJoint(joint));
    const std::string dh = keys.Text("dh");
    if (dh != "modified" && dh != "standard") keys.Fail("dh", "\"modified\" or \"standard\"");
    if (dh == "standard") ShiftStandardDh(robot);
  }
  if (robot.joint.empty()) keys.Fail("joint", "at least one [[joint]]");
  robot.tool_frame = robot.tool_frame * tool;
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
