// description - SDF, MJCF, YAML and a C header: files that are written whole. Link frames are the DH frames.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cctype>

#include "codegen/src/robot/body.hpp"
#include "codegen/src/robot/frames.hpp"
#include "host_sim/identify/description/described_arm.hpp"

namespace armcal::description {

namespace {

using codegen::Joint;
using codegen::JointType;

bool Slides(const Joint& joint) { return joint.kinematics.type == JointType::kPrismatic; }

Eigen::Isometry3d Base(const codegen::Robot& robot) { return codegen::ToPose(robot.base_xyz_m, robot.base_rotation); }

// Each DH frame at joint position zero, seen from the one before; the first from the base.
Eigen::Isometry3d FrameOf(const codegen::Robot& robot, std::size_t j) {
  const Eigen::Isometry3d row = codegen::ModifiedDh(robot.joint[j].kinematics);
  return j == 0 ? Base(robot) * row : row;
}

std::string LinkName(const codegen::Robot& robot, std::size_t j) { return robot.joint[j].name + "_link"; }

std::string XmlText(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '&'   ? std::string("&amp;")
           : c == '<' ? std::string("&lt;")
           : c == '"' ? std::string("&quot;")
                      : std::string(1, c);
  return out;
}

std::string Pose(const Eigen::Isometry3d& T) {
  return Exact(Eigen::Vector3d(T.translation())) + " " + Exact(ToRollPitchYaw(T.linear()));
}

// What only a table of this project can hold.
std::vector<std::string> Effects(const DescribedArm& arm) {
  std::vector<std::string> out;
  for (const Value& v : arm.effect) out.push_back(fmt::format("{} = {:.6g} {}", v.name, v.value, v.unit));
  for (std::size_t j = 0; j < arm.joint.size(); ++j)
    if (arm.joint[j].torque_scale != 1)
      out.push_back(fmt::format("torque scale of {} = {:.6g}", arm.robot.joint[j].name, arm.joint[j].torque_scale));
  if (!arm.robot.coupling.empty()) out.push_back("the coupling of the motors");
  return out;
}

std::vector<std::string> Rotors(const DescribedArm& arm) {
  std::vector<std::string> out;
  for (std::size_t j = 0; j < arm.joint.size(); ++j)
    if (arm.joint[j].rotor_kgm2 > 0)
      out.push_back(fmt::format("rotor inertia of {} = {:.6g} {}", arm.robot.joint[j].name, arm.joint[j].rotor_kgm2,
                                Slides(arm.robot.joint[j]) ? "kg" : "kg*m^2"));
  return out;
}

std::string Remark(const DescribedArm& arm) {
  return fmt::format("{}: written by armcal export from {}. Link frames are modified DH frames.", arm.robot.name,
                     arm.source);
}

std::string Comment(std::string text) {  // no comment of XML holds two hyphens
  for (auto at = text.find("--"); at != text.npos; at = text.find("--", at)) text.replace(at, 2, "- -");
  return "<!-- " + text + " -->";
}

std::string Identifier(const std::string& name) {
  std::string out;
  for (const char c : name)
    out += std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
                                                       : '_';
  return out;
}

const char* const kInertiaName[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};

}  // namespace

std::vector<std::string> NotInUrdf(const DescribedArm& arm) {
  std::vector<std::string> out = Rotors(arm);
  for (const std::string& line : Effects(arm)) out.push_back(line);
  const auto& g = arm.robot.gravity_mps2;
  if (g[0] != 0 || g[1] != 0 || g[2] > 0)
    out.push_back(
        fmt::format("the mounting: gravity is [{:.6g}, {:.6g}, {:.6g}] m/s^2 in the base frame", g[0], g[1], g[2]));
  return out;
}

Description ToSdf(const DescribedArm& arm) {
  const codegen::Robot& robot = arm.robot;
  Description d;
  d.text = "<?xml version=\"1.0\"?>\n" + Comment(Remark(arm)) + "\n<sdf version=\"1.8\">\n";
  d.text += fmt::format("  <model name=\"{}\">\n    <static>false</static>\n    <link name=\"base\">\n", robot.name);
  d.text += "      <inertial><mass>1</mass></inertial>\n    </link>\n";
  d.text += "    <joint name=\"base_to_world\" type=\"fixed\"><parent>world</parent><child>base</child></joint>\n";
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const Joint& joint = robot.joint[j];
    const std::string parent = j == 0 ? "base" : LinkName(robot, j - 1);
    const codegen::Link& body = arm.joint[j].body;
    d.text += fmt::format("    <link name=\"{}\">\n      <pose relative_to=\"{}\">{}</pose>\n      <inertial>\n",
                          XmlText(LinkName(robot, j)), XmlText(parent), Pose(FrameOf(robot, j)));
    d.text +=
        fmt::format("        <pose>{} {} {} 0 0 0</pose>\n        <mass>{}</mass>\n        <inertia>",
                    Exact(body.center_m[0]), Exact(body.center_m[1]), Exact(body.center_m[2]), Exact(body.mass_kg));
    for (int k = 0; k < 6; ++k)
      d.text += fmt::format("<{0}>{1}</{0}>", kInertiaName[k], Exact(body.inertia_kgm2[static_cast<std::size_t>(k)]));
    d.text += fmt::format("</inertia>\n      </inertial>\n    </link>\n    <joint name=\"{}\" type=\"{}\">\n",
                          XmlText(joint.name), Slides(joint) ? "prismatic" : "revolute");
    d.text +=
        fmt::format("      <parent>{}</parent>\n      <child>{}</child>\n      <axis>\n        <xyz>0 0 1</xyz>\n",
                    XmlText(parent), XmlText(LinkName(robot, j)));
    d.text += fmt::format(
        "        <limit><lower>{}</lower><upper>{}</upper><effort>{}</effort><velocity>{}</velocity></limit>\n",
        Exact(joint.position_limit_rad[0]), Exact(joint.position_limit_rad[1]), Exact(joint.torque_limit_Nm),
        Exact(joint.speed_limit_radps));
    d.text += fmt::format("        <dynamics><damping>{}</damping><friction>{}</friction></dynamics>\n",
                          Exact(arm.joint[j].viscous_Nmsprad), Exact(arm.joint[j].coulomb_Nm));
    d.text += "      </axis>\n    </joint>\n";
  }
  d.text += "  </model>\n</sdf>\n";
  d.left_out = NotInUrdf(arm);
  return d;
}

Description ToMjcf(const DescribedArm& arm) {
  const codegen::Robot& robot = arm.robot;
  const auto& g = robot.gravity_mps2;
  Description d;
  d.text = Comment(Remark(arm)) + fmt::format("\n<mujoco model=\"{}\">\n", robot.name);
  d.text += "  <compiler angle=\"radian\" autolimits=\"true\"/>\n";
  d.text += fmt::format("  <option gravity=\"{} {} {}\"/>\n  <worldbody>\n", Exact(g[0]), Exact(g[1]), Exact(g[2]));
  std::string indent = "    ";
  for (std::size_t j = 0; j < arm.joint.size(); ++j, indent += "  ") {
    const Joint& joint = robot.joint[j];
    const DescribedJoint& own = arm.joint[j];
    const Eigen::Isometry3d T = FrameOf(robot, j);
    const Eigen::Quaterniond turn(T.linear());
    const auto& c = own.body.center_m;
    // MuJoCo finds the principal axes of a full inertia to eight digits only.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(codegen::Symmetric(own.body.inertia_kgm2));
    const Eigen::Vector3d I = principal.eigenvalues();
    Eigen::Matrix3d axes = principal.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    const Eigen::Quaterniond tilt(axes);
    d.text += fmt::format("{}<body name=\"{}\" pos=\"{}\" quat=\"{} {} {} {}\">\n", indent, XmlText(LinkName(robot, j)),
                          Exact(Eigen::Vector3d(T.translation())), Exact(turn.w()), Exact(turn.x()), Exact(turn.y()),
                          Exact(turn.z()));
    d.text += fmt::format("{}  <inertial pos=\"{} {} {}\" quat=\"{} {} {} {}\" mass=\"{}\" diaginertia=\"{}\"/>\n",
                          indent, Exact(c[0]), Exact(c[1]), Exact(c[2]), Exact(tilt.w()), Exact(tilt.x()),
                          Exact(tilt.y()), Exact(tilt.z()), Exact(own.body.mass_kg), Exact(I));
    d.text += fmt::format(
        "{}  <joint name=\"{}\" type=\"{}\" axis=\"0 0 1\" range=\"{} {}\" armature=\"{}\" damping=\"{}\" "
        "frictionloss=\"{}\"/>\n",
        indent, XmlText(joint.name), Slides(joint) ? "slide" : "hinge", Exact(joint.position_limit_rad[0]),
        Exact(joint.position_limit_rad[1]), Exact(own.rotor_kgm2), Exact(own.viscous_Nmsprad), Exact(own.coulomb_Nm));
  }
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    indent.resize(indent.size() - 2);
    d.text += indent + "</body>\n";
  }
  d.text += "  </worldbody>\n  <actuator>\n";
  for (const Joint& joint : robot.joint)
    d.text += fmt::format("    <motor name=\"{0}_motor\" joint=\"{0}\" ctrlrange=\"{1} {2}\"/>\n", XmlText(joint.name),
                          Exact(-joint.torque_limit_Nm), Exact(joint.torque_limit_Nm));
  d.text += "  </actuator>\n</mujoco>\n";
  d.left_out = Effects(arm);
  for (const Joint& joint : robot.joint)
    d.left_out.push_back(fmt::format("speed limit of {} = {:.6g} {}", joint.name, joint.speed_limit_radps,
                                     Slides(joint) ? "m/s" : "rad/s"));
  return d;
}

Description ToYaml(const DescribedArm& arm) {
  const auto quoted = [](const std::string& text) {
    std::string out;
    for (const char c : text) out += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    return "\"" + out + "\"";
  };
  Description d;
  d.text = "# " + Remark(arm) + "\n";
  d.text += fmt::format("robot: {}\nschema: \"{:08X}\"\nsource: {}\njoints:\n", arm.robot.name, arm.schema,
                        quoted(arm.source));
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const DescribedJoint& own = arm.joint[j];
    const Joint& joint = arm.robot.joint[j];
    const codegen::JointKinematics& k = joint.kinematics;
    const char* const force = Slides(joint) ? "N" : "Nm";
    d.text += fmt::format("  - name: {}\n    type: {}\n", quoted(joint.name), Slides(joint) ? "prismatic" : "revolute");
    d.text += fmt::format("    modified_dh: {{ alpha_rad: {}, a_m: {}, theta_rad: {}, d_m: {} }}\n", Exact(k.alpha_rad),
                          Exact(k.a_m), Exact(k.theta_rad), Exact(k.d_m));
    d.text += fmt::format("    mass_kg: {}\n    center_m: [{}, {}, {}]\n", Exact(own.body.mass_kg),
                          Exact(own.body.center_m[0]), Exact(own.body.center_m[1]), Exact(own.body.center_m[2]));
    d.text += "    inertia_kgm2: {";  // about the centre
    for (std::size_t i = 0; i < 6; ++i)
      d.text += fmt::format("{} {}: {}", i ? "," : "", kInertiaName[i], Exact(own.body.inertia_kgm2[i]));
    d.text += fmt::format(" }}  # about the centre\n    rotor_inertia_{}: {}\n", Slides(joint) ? "kg" : "kgm2",
                          Exact(own.rotor_kgm2));
    d.text +=
        fmt::format("    coulomb_{}: {}\n    viscous_{}: {}\n    torque_scale: {}\n", force, Exact(own.coulomb_Nm),
                    Slides(joint) ? "Nspm" : "Nmsprad", Exact(own.viscous_Nmsprad), Exact(own.torque_scale));
  }
  d.text += arm.effect.empty() ? "effects: []\n" : "effects:\n";
  for (const Value& v : arm.effect)
    d.text += fmt::format("  - {{ name: {}, value: {}, unit: {} }}\n", quoted(v.name), Exact(v.value), quoted(v.unit));
  if (!arm.robot.coupling.empty()) {
    d.text += "coupling:  # q_motor = C q, row by row\n  [";
    for (std::size_t k = 0; k < arm.robot.coupling.size(); ++k)
      d.text += (k ? ", " : "") + Exact(arm.robot.coupling[k]);
    d.text += "]\n";
  }
  return d;
}

Description ToHeader(const DescribedArm& arm) {
  const std::string prefix = Identifier(arm.robot.name);
  Description d;
  d.text = fmt::format("/* {} */\n#ifndef {}_PARAMETERS_H\n#define {}_PARAMETERS_H\n\n", Remark(arm), prefix, prefix);
  const auto line = [&](const std::string& name, double value, const std::string& unit) {
    std::string number = Exact(value);
    if (number.find_first_of(".e") == number.npos) number += ".0";
    d.text += fmt::format("#define {}_{} ({}) /* {} */\n", prefix, Identifier(name), number, unit);
  };
  d.text +=
      fmt::format("#define {}_SCHEMA 0x{:08X}u\n#define {}_JOINTS {}\n", prefix, arm.schema, prefix, arm.joint.size());
  for (std::size_t j = 0; j < arm.joint.size(); ++j) {
    const DescribedJoint& own = arm.joint[j];
    const bool slide = Slides(arm.robot.joint[j]);
    const std::string number = std::to_string(j + 1);
    d.text +=
        fmt::format("\n/* {}: body in the joint's DH frame, inertia about the centre */\n", arm.robot.joint[j].name);
    line("m" + number, own.body.mass_kg, "kg");
    const char* const axis[] = {"cx", "cy", "cz"};
    for (std::size_t k = 0; k < 3; ++k) line(axis[k] + number, own.body.center_m[k], "m");
    for (std::size_t k = 0; k < 6; ++k) line(kInertiaName[k] + number, own.body.inertia_kgm2[k], "kg*m^2");
    line("Ia" + number, own.rotor_kgm2, slide ? "kg" : "kg*m^2");
    line("Fc" + number, own.coulomb_Nm, slide ? "N" : "N*m");
    line("Fv" + number, own.viscous_Nmsprad, slide ? "N*s/m" : "N*m*s/rad");
    line("torque_scale" + number, own.torque_scale, "1");
  }
  if (!arm.effect.empty()) d.text += "\n/* effects */\n";
  for (const Value& v : arm.effect) line(v.name, v.value, v.unit);
  if (!arm.robot.coupling.empty()) d.left_out.push_back("the coupling of the motors");
  d.text += fmt::format("\n#endif\n");
  return d;
}

}  // namespace armcal::description
