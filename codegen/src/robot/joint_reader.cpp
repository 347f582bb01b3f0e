// robot - one [[joint]] table: kinematics, body, limits, motor; knows no other table.
#include "codegen/src/robot/joint_reader.hpp"

#include <algorithm>

namespace armcal::codegen {
namespace {

constexpr std::string_view kDriveKeys[] = {"name",
                                           "position_limit_deg",
                                           "position_limit_m",
                                           "speed_limit_degps",
                                           "speed_limit_mps",
                                           "acceleration_limit_radps2",
                                           "acceleration_limit_mps2",
                                           "torque_limit_Nm",
                                           "torque_limit_N",
                                           "torque_noise_Nm",
                                           "torque_noise_N",
                                           "v_min_radps",
                                           "v_min_mps",
                                           "coulomb_Nm",
                                           "coulomb_N",
                                           "viscous_Nmsprad",
                                           "viscous_Nspm",
                                           "encoder",
                                           "motor"};

Motor ReadMotor(const io::TomlReader& in, bool prismatic) {
  Motor m;
  const io::TomlReader encoder = in.Table("encoder"), motor = in.Table("motor");
  encoder.AllowOnly({"counts_per_turn", "zero_counts"});
  motor.AllowOnly(
      {"gear_ratio", "current_A_per_lsb", "torque_constant_NmpA", "torque_constant_tolerance", "rotor_inertia_kgm2"});
  m.counts_per_turn = encoder.Positive("counts_per_turn");
  m.zero_counts = static_cast<int>(encoder.Number("zero_counts", 0));
  m.gear_ratio = motor.Number("gear_ratio");
  if (m.gear_ratio == 0)
    motor.Fail("gear_ratio", prismatic ? "motor radians per metre, not zero" : "a ratio, not zero");
  m.current_A_per_lsb = motor.Positive("current_A_per_lsb");
  m.torque_constant_NmpA = motor.Positive("torque_constant_NmpA");
  m.torque_constant_tolerance = motor.Number("torque_constant_tolerance", 0);
  m.rotor_inertia_kgm2 = motor.Number("rotor_inertia_kgm2", 0);
  if (m.rotor_inertia_kgm2 < 0) motor.Fail("rotor_inertia_kgm2", "a number not below zero");
  return m;
}

}  // namespace

void AllowDriveKeys(const io::TomlReader& in) { in.AllowOnly(kDriveKeys); }

void ReadDrive(const io::TomlReader& in, Joint& j, bool limited) {
  const bool prismatic = j.kinematics.type == JointType::kPrismatic;
  const char* const position = prismatic ? "position_limit_m" : "position_limit_deg";
  const char* const speed = prismatic ? "speed_limit_mps" : "speed_limit_degps";
  const char* const torque = prismatic ? "torque_limit_N" : "torque_limit_Nm";
  if (!limited || in.Has(position)) {
    const auto limits = in.Numbers(position, 2);
    for (int k = 0; k < 2; ++k) j.position_limit_rad[k] = prismatic ? limits[k] : limits[k] * kRadPerDeg;
  }
  if (!(j.position_limit_rad[0] < j.position_limit_rad[1])) in.Fail(position, "[lower, upper] with lower < upper");
  if (j.speed_limit_radps <= 0 || in.Has(speed))
    j.speed_limit_radps = prismatic ? in.Positive(speed) : in.Positive(speed) * kRadPerDeg;
  if (j.torque_limit_Nm <= 0 || in.Has(torque)) j.torque_limit_Nm = in.Positive(torque);
  j.acceleration_limit_radps2 = in.Positive(prismatic ? "acceleration_limit_mps2" : "acceleration_limit_radps2");
  j.torque_noise_Nm = in.Positive(prismatic ? "torque_noise_N" : "torque_noise_Nm");
  j.v_min_radps = in.Positive(prismatic ? "v_min_mps" : "v_min_radps");
  j.nominal["Fc"] = in.Number(prismatic ? "coulomb_N" : "coulomb_Nm", j.nominal["Fc"]);
  j.nominal["Fv"] = in.Number(prismatic ? "viscous_Nspm" : "viscous_Nmsprad", j.nominal["Fv"]);
  j.has_motor = in.Has("motor");
  if (j.has_motor) j.motor = ReadMotor(in, prismatic);
}

Joint ReadJoint(const io::TomlReader& in, bool has_prior) {
  Joint j;
  const std::string_view body[] = {"type", "alpha_deg", "a_m", "d_m", "offset_deg", "offset_m", "link"};
  in.AllowOnly(kDriveKeys, body);
  j.name = in.Text("name");
  const std::string type = in.Text("type");
  if (type != "revolute" && type != "prismatic") in.Fail("type", "\"revolute\" or \"prismatic\"");
  const bool prismatic = type == "prismatic";
  j.kinematics.type = prismatic ? JointType::kPrismatic : JointType::kRevolute;
  j.kinematics.alpha_rad = in.Number("alpha_deg") * kRadPerDeg;
  j.kinematics.a_m = in.Number("a_m");
  j.kinematics.d_m = in.Number("d_m") + (prismatic ? in.Number("offset_m", 0) : 0);
  j.kinematics.theta_rad = in.Number("offset_deg", 0) * kRadPerDeg;
  ReadDrive(in, j, false);
  if (!has_prior) return j;
  const io::TomlReader link = in.Table("link");
  link.AllowOnly({"mass_kg", "center_m", "inertia_kgm2"});
  j.link.mass_kg = link.Positive("mass_kg");
  const auto center = link.Numbers("center_m", 3), inertia = link.Numbers("inertia_kgm2", 6);
  std::copy(center.begin(), center.end(), j.link.center_m.begin());
  std::copy(inertia.begin(), inertia.end(), j.link.inertia_kgm2.begin());
  return j;
}

}  // namespace armcal::codegen
