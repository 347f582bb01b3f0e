// robot - reads a robot file; checks every number; knows no dynamics.
#include "codegen/src/robot/robot.hpp"

#include <numbers>

#include "codegen/src/robot/toml_reader.hpp"

namespace armcal::codegen {
namespace {

double Radians(double deg) { return deg * std::numbers::pi / 180.0; }

std::array<double, 3> Three(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

// Fixed-axis roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll), row-major. Multiples of 90 deg are exact.
std::array<double, 9> RotationFromRpy(const std::vector<double>& rpy_deg) {
  const auto snap = [](double v) {
    return std::abs(v) < 1e-15 ? 0.0 : (std::abs(std::abs(v) - 1) < 1e-15 ? std::copysign(1.0, v) : v);
  };
  double s[3], c[3];
  for (int i = 0; i < 3; ++i) s[i] = snap(std::sin(Radians(rpy_deg[i]))), c[i] = snap(std::cos(Radians(rpy_deg[i])));
  return {c[2] * c[1],
          c[2] * s[1] * s[0] - s[2] * c[0],
          c[2] * s[1] * c[0] + s[2] * s[0],
          s[2] * c[1],
          s[2] * s[1] * s[0] + c[2] * c[0],
          s[2] * s[1] * c[0] - c[2] * s[0],
          -s[1],
          c[1] * s[0],
          c[1] * c[0]};
}

Motor ReadMotor(const TomlReader& in, bool prismatic) {
  Motor m;
  const TomlReader encoder = in.Table("encoder"), motor = in.Table("motor");
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

Joint ReadJoint(const TomlReader& in, bool has_prior) {
  Joint j;
  in.AllowOnly({"name",
                "type",
                "alpha_deg",
                "a_m",
                "d_m",
                "offset_deg",
                "offset_m",
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
                "motor",
                "link"});
  j.name = in.Text("name");
  const std::string type = in.Text("type");
  if (type != "revolute" && type != "prismatic") in.Fail("type", "\"revolute\" or \"prismatic\"");
  const bool prismatic = type == "prismatic";
  j.kinematics.type = prismatic ? JointType::kPrismatic : JointType::kRevolute;
  j.kinematics.alpha_rad = Radians(in.Number("alpha_deg"));
  j.kinematics.a_m = in.Number("a_m");
  j.kinematics.d_m = in.Number("d_m") + (prismatic ? in.Number("offset_m", 0) : 0);
  j.kinematics.theta_rad = Radians(in.Number("offset_deg", 0));
  const auto limits = in.Numbers(prismatic ? "position_limit_m" : "position_limit_deg", 2);
  if (!(limits[0] < limits[1]))
    in.Fail(prismatic ? "position_limit_m" : "position_limit_deg", "[lower, upper] with lower < upper");
  for (int k = 0; k < 2; ++k) j.position_limit_rad[k] = prismatic ? limits[k] : Radians(limits[k]);
  j.speed_limit_radps = prismatic ? in.Positive("speed_limit_mps") : Radians(in.Positive("speed_limit_degps"));
  j.acceleration_limit_radps2 = in.Positive(prismatic ? "acceleration_limit_mps2" : "acceleration_limit_radps2");
  j.torque_limit_Nm = in.Positive(prismatic ? "torque_limit_N" : "torque_limit_Nm");
  j.torque_noise_Nm = in.Positive(prismatic ? "torque_noise_N" : "torque_noise_Nm");
  j.v_min_radps = in.Positive(prismatic ? "v_min_mps" : "v_min_radps");
  j.nominal["Fc"] = in.Number(prismatic ? "coulomb_N" : "coulomb_Nm", 0);
  j.nominal["Fv"] = in.Number(prismatic ? "viscous_Nspm" : "viscous_Nmsprad", 0);
  j.has_motor = in.Has("motor");
  if (j.has_motor) j.motor = ReadMotor(in, prismatic);
  if (!has_prior) return j;
  const TomlReader link = in.Table("link");
  link.AllowOnly({"mass_kg", "center_m", "inertia_kgm2"});
  j.link.mass_kg = link.Positive("mass_kg");
  j.link.center_m = Three(link.Numbers("center_m", 3));
  const auto inertia = link.Numbers("inertia_kgm2", 6);
  for (int k = 0; k < 6; ++k) j.link.inertia_kgm2[k] = inertia[k];
  return j;
}

// Standard DH link i: Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i). The joint axis of joint i is z_{i-1}; shifting the
// frames by one gives modified DH with (alpha_{i-1}, a_{i-1}) of the row before: link i's frame is then at the axis of
// joint i. The last row's (a_n, alpha_n) lead from the last link's frame to the flange and belong to the tool frame.
void ConvertStandardDh(std::vector<Joint>& joints) {
  double alpha = 0, a = 0;
  for (Joint& j : joints) {
    std::swap(alpha, j.kinematics.alpha_rad);
    std::swap(a, j.kinematics.a_m);
  }
}

EffectUse ReadEffectUse(const TomlReader& in, int joints) {
  in.AllowOnly({"name", "joints", "state", "mean", "nonlinear"});
  EffectUse use;
  use.effect = in.Text("name");
  use.state = in.Text("state", "estimated");
  if (use.state != "estimated" && use.state != "standby" && use.state != "fixed" && use.state != "considered")
    in.Fail("state", "\"estimated\", \"standby\", \"fixed\" or \"considered\"");
  if (in.Has("joints"))
    for (const double j : in.Numbers("joints")) {
      if (j < 1 || j > joints || j != std::floor(j)) in.Fail("joints", "joint numbers 1.." + std::to_string(joints));
      use.joints.push_back(static_cast<int>(j) - 1);
    }
  for (const auto* key : {"mean", "nonlinear"}) {
    if (!in.Has(key)) continue;
    const TomlReader values = in.Table(key);
    auto& target = std::string_view(key) == "mean" ? use.mean : use.nonlinear;
    for (const auto& [k, v] : values.table()) target[std::string(k.str())] = values.Number(k.str());
  }
  return use;
}

}  // namespace

Robot ReadRobot(const std::filesystem::path& path) {
  const toml::table table = ParseToml(path);
  const TomlReader in(table, path.string());
  in.AllowOnly({"name", "title", "source", "gravity_mps2", "dh", "sign_law", "sign_width_radps", "sign_width_mps",
                "tick_rate_Hz", "sample_ticks", "prior", "control", "joint", "effect", "coupling", "base_frame",
                "tool_frame", "identified"});
  Robot r;
  r.path = path.string();
  r.name = in.Text("name");
  if (r.name.empty() || r.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    in.Fail("name", "lower-case letters, digits and _");
  r.title = in.Text("title", r.name);
  r.source = in.Text("source");
  r.gravity_mps2 = Three(in.Numbers("gravity_mps2", 3));
  const std::string dh = in.Text("dh");
  if (dh != "modified" && dh != "standard") in.Fail("dh", "\"modified\" or \"standard\"");
  r.sign_law = in.Text("sign_law", "sgn");
  if (r.sign_law != "sgn" && r.sign_law != "tanh") in.Fail("sign_law", "\"sgn\" or \"tanh\"");
  if (r.sign_law == "tanh")
    r.sign_width_radps = in.Has("sign_width_mps") ? in.Positive("sign_width_mps") : in.Positive("sign_width_radps");
  r.tick_rate_Hz = in.Number("tick_rate_Hz", 1000);
  r.sample_ticks = static_cast<int>(in.Number("sample_ticks", 8));
  if (r.tick_rate_Hz <= 0 || r.sample_ticks < 1 || r.sample_ticks > 64)
    in.Fail("sample_ticks", "1..64 at a positive tick_rate_Hz");
  if (in.Has("prior") && in.table()["prior"].is_string()) {
    if (in.Text("prior") != "none") in.Fail("prior", "\"none\" or a table");
    r.has_prior = false;
  } else if (in.Has("prior")) {
    const TomlReader prior = in.Table("prior");
    prior.AllowOnly({"link_relative_sd", "center_floor_m", "inertia_floor_ratio", "friction_relative_sd"});
    r.link_relative_sd = prior.Number("link_relative_sd", r.link_relative_sd);
    r.center_floor_m = prior.Number("center_floor_m", r.center_floor_m);
    r.inertia_floor_ratio = prior.Number("inertia_floor_ratio", r.inertia_floor_ratio);
    r.friction_relative_sd = prior.Number("friction_relative_sd", r.friction_relative_sd);
  }
  for (const TomlReader& joint : in.Tables("joint")) r.joint.push_back(ReadJoint(joint, r.has_prior));
  const int n = r.joints();
  if (n < 1 || n > 7) in.Fail("joint", "1 to 7 [[joint]] tables");
  if (dh == "standard") ConvertStandardDh(r.joint);
  if (in.Has("coupling")) r.coupling = in.Table("coupling").Numbers("matrix", n * n);
  if (in.Has("base_frame")) {
    const TomlReader base = in.Table("base_frame");
    base.AllowOnly({"xyz_m", "rpy_deg"});
    r.base_rotation = RotationFromRpy(base.Numbers("rpy_deg", 3));
  }
  for (const TomlReader& use : in.Tables("effect")) r.effect.push_back(ReadEffectUse(use, n));
  if (in.Has("control")) {
    const TomlReader control = in.Table("control");
    r.control.structure = control.Text("structure");
    r.control.rate_Hz = control.Positive("rate_Hz");
    r.control.kp_Nmprad = control.Numbers("kp_Nmprad", n);
    r.control.kd_Nmsprad = control.Numbers("kd_Nmsprad", n);
  }
  return r;
}

}  // namespace armcal::codegen
