// description - YAML and a C header. Bodies are in the DH frames.
#include <fmt/format.h>

#include <cctype>

#include "host_sim/identify/description/described_arm.hpp"
#include "host_sim/identify/description/file_text.hpp"

namespace armcal::description {

namespace {

using codegen::Joint;

std::string Identifier(const std::string& name) {
  std::string out;
  for (const char c : name)
    out += std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
                                                       : '_';
  return out;
}

}  // namespace

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
