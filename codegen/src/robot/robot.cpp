// robot - reads a robot file and checks every number.
#include "codegen/src/robot/robot.hpp"

#include <algorithm>
#include <numbers>

#include "codegen/src/io/toml_reader.hpp"
#include "codegen/src/robot/frames.hpp"
#include "codegen/src/robot/payload.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

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

CeilingSettings ReadCeilings(const io::TomlReader& in, int joints) {
  CeilingSettings c;
  in.AllowOnly({"torque_Nm", "friction_Nm", "noise_Nm", "torque_scale", "temperature_degC", "feed_share",
                "least_fade_ms", "longest_fade_ms", "least_forgetting", "parameter"});
  const auto each = [&](std::string_view key, std::vector<double>& values) {
    if (!in.Has(key)) return;
    values = in.Numbers(key, static_cast<std::size_t>(joints));
    for (const double v : values)
      if (!(v > 0)) in.Fail(key, "numbers above zero, one a joint");
  };
  const auto range = [](const io::TomlReader& from, std::string_view key, std::array<double, 2>& values) {
    if (!from.Has(key)) return;
    const auto given = from.Numbers(key, 2);
    if (!(given[0] <= given[1])) from.Fail(key, "[lowest, highest]");
    values = {given[0], given[1]};
  };
  each("torque_Nm", c.torque_Nm);
  each("friction_Nm", c.friction_Nm);
  each("noise_Nm", c.noise_Nm);
  range(in, "torque_scale", c.torque_scale);
  if (!(c.torque_scale[0] > 0)) in.Fail("torque_scale", "[lowest, highest] above zero");
  range(in, "temperature_degC", c.temperature_degC);
  c.feed_share = in.NotNegative("feed_share", c.feed_share);
  c.least_fade_ms = in.Positive("least_fade_ms", c.least_fade_ms);
  c.longest_fade_ms = in.Positive("longest_fade_ms", c.longest_fade_ms);
  if (c.longest_fade_ms < c.least_fade_ms || c.longest_fade_ms > 1e6)
    in.Fail("longest_fade_ms", "least_fade_ms to 1000000");
  c.least_forgetting = in.Positive("least_forgetting", c.least_forgetting);
  if (c.least_forgetting > 1) in.Fail("least_forgetting", "a number above 0 and not above 1");
  if (!in.Has("parameter")) return c;
  const io::TomlReader parameter = in.Table("parameter");
  for (const auto& [key, value] : parameter.table()) range(parameter, key.str(), c.parameter[std::string(key.str())]);
  return c;
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

// {xyz_m, rpy_deg}, each may be absent.
Eigen::Isometry3d ReadFrame(const io::TomlReader& in) {
  in.AllowOnly({"xyz_m", "rpy_deg"});
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (in.Has("xyz_m")) T.translation() = Eigen::Vector3d(in.Numbers("xyz_m", 3).data());
  if (in.Has("rpy_deg")) T.linear() = RollPitchYaw(Eigen::Vector3d(in.Numbers("rpy_deg", 3).data()) * kRadPerDeg);
  return T;
}

// Kinematics, bodies and limits from the URDF; one [[joint]] table per movable joint, found by its name, says the rest.
void ReadUrdfRobot(const io::TomlReader& in, Robot& r, Eigen::Isometry3d& base, Eigen::Isometry3d& flange) {
  if (in.Has("dh")) in.Fail("dh", "either dh or urdf");
  UrdfChain chain = ReadUrdf(std::filesystem::path(in.file()).parent_path() / in.Text("urdf"));
  base = chain.base, flange = chain.flange;
  r.joint = std::move(chain.joint);
  std::vector<bool> told(r.joint.size(), false);
  for (const io::TomlReader& table : in.Tables("joint")) {
    AllowDriveKeys(table);
    const std::string name = table.Text("name");
    std::size_t j = 0;
    while (j < r.joint.size() && (told[j] || r.joint[j].name != name)) ++j;
    if (j == r.joint.size()) table.Fail("name", "the name of a movable joint of the URDF, once");
    ReadDrive(table, r.joint[j], chain.limited[j]);
    told[j] = true;
    if (r.has_prior && !(r.joint[j].link.mass_kg > 0))
      table.Fail("name", "a link with mass after this joint of the URDF, or prior = \"none\"");
  }
  for (std::size_t j = 0; j < told.size(); ++j)
    if (!told[j]) in.Fail("joint", "a [[joint]] table with name = \"" + r.joint[j].name + "\"");
}

std::vector<int> ReadBodyParameters(const io::TomlReader& in, std::string_view key, int joints) {
  std::vector<int> out;
  for (const std::string& name : in.Texts(key)) {
    int found = -1;
    for (int c = 0; c < 11 * joints; ++c)
      if (name == kBodyParameterName[c % 11] + std::to_string(c / 11 + 1)) found = c;
    if (found < 0) in.Fail(key, "body parameters m1, mx1 ... Ia" + std::to_string(joints) + ", not \"" + name + "\"");
    out.push_back(found);
  }
  return out;
}

// Standard DH link i: Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i). The joint axis of joint i is z_{i-1}; shifting the
// frames by one gives modified DH with (alpha_{i-1}, a_{i-1}) of the row before: link i's frame is then at the axis of
// joint i. The last row's (a_n, alpha_n) lead from the last link's frame to the flange, which is what is returned.
Eigen::Isometry3d ConvertStandardDh(std::vector<Joint>& joints) {
  double alpha = 0, a = 0;
  for (Joint& j : joints) {
    std::swap(alpha, j.kinematics.alpha_rad);
    std::swap(a, j.kinematics.a_m);
  }
  return ModifiedDh({JointType::kRevolute, alpha, a, 0, 0});
}

EffectUse ReadEffectUse(const io::TomlReader& in, int joints) {
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
    const io::TomlReader values = in.Table(key);
    auto& target = std::string_view(key) == "mean" ? use.mean : use.nonlinear;
    for (const auto& [k, v] : values.table()) target[std::string(k.str())] = values.Number(k.str());
  }
  return use;
}

}  // namespace

Robot ReadRobot(const std::filesystem::path& path) {
  const toml::table table = io::ParseToml(path);
  const io::TomlReader in(table, path.string());
  in.AllowOnly(
      {"name",           "title",        "source",       "gravity_mps2", "dh",      "sign_law",   "sign_width_radps",
       "sign_width_mps", "tick_rate_Hz", "sample_ticks", "prior",        "control", "joint",      "effect",
       "coupling",       "base_frame",   "tool_frame",   "identified",   "urdf",    "parameters", "payload",
       "ceilings"});
  Robot r;
  r.path = path.string();
  r.name = in.Text("name");
  if (r.name.empty() || r.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    in.Fail("name", "lower-case letters, digits and _");
  r.title = in.Text("title", r.name);
  r.source = in.Text("source");
  const auto gravity = in.Numbers("gravity_mps2", 3);
  std::copy(gravity.begin(), gravity.end(), r.gravity_mps2.begin());
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
    const io::TomlReader prior = in.Table("prior");
    prior.AllowOnly({"link_relative_sd", "center_floor_m", "inertia_floor_ratio", "friction_relative_sd"});
    r.link_relative_sd = prior.Number("link_relative_sd", r.link_relative_sd);
    r.center_floor_m = prior.Number("center_floor_m", r.center_floor_m);
    r.inertia_floor_ratio = prior.Number("inertia_floor_ratio", r.inertia_floor_ratio);
    r.friction_relative_sd = prior.Number("friction_relative_sd", r.friction_relative_sd);
  }
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity(), flange = base;
  if (in.Has("urdf")) {
    ReadUrdfRobot(in, r, base, flange);
  } else {
    const std::string dh = in.Text("dh");
    if (dh != "modified" && dh != "standard") in.Fail("dh", "\"modified\" or \"standard\"");
    for (const io::TomlReader& joint : in.Tables("joint")) r.joint.push_back(ReadJoint(joint, r.has_prior));
    if (dh == "standard") flange = ConvertStandardDh(r.joint);
  }
  const int n = r.joints();
  if (n < 1 || n > 7) in.Fail("joint", "1 to 7 [[joint]] tables");
  if (in.Has("coupling")) r.coupling = in.Table("coupling").Numbers("matrix", n * n);
  if (in.Has("base_frame")) base = ReadFrame(in.Table("base_frame")) * base;
  if (in.Has("tool_frame")) flange = flange * ReadFrame(in.Table("tool_frame"));
  r.base_xyz_m = Components(base.translation()), r.base_rotation = RowMajor(base.linear());
  r.tool_xyz_m = Components(flange.translation()), r.tool_rotation = RowMajor(flange.linear());
  if (in.Has("payload")) {
    if (!r.has_prior) in.Fail("payload", "links with bodies to carry it; prior = \"none\" leaves them out");
    const io::TomlReader clamped = in.Table("payload");
    const Payload payload = ReadPayload(clamped);
    if (!payload.inertia_kgm2) clamped.Fail("inertia_kgm2", "6 numbers");
    r.joint.back().link = Carrying(r.joint.back().link, flange, payload);
  }
  if (in.Has("parameters")) {
    const io::TomlReader set = in.Table("parameters");
    set.AllowOnly({"set", "prefer", "omit"});
    const std::string kind = set.Text("set", "base");
    if (kind != "base" && kind != "standard") set.Fail("set", "\"base\" or \"standard\"");
    r.parameters = {kind == "standard", ReadBodyParameters(set, "prefer", n), ReadBodyParameters(set, "omit", n)};
  }
  if (in.Has("ceilings")) r.ceilings = ReadCeilings(in.Table("ceilings"), n);
  for (const io::TomlReader& use : in.Tables("effect")) r.effect.push_back(ReadEffectUse(use, n));
  if (in.Has("control")) {
    const io::TomlReader control = in.Table("control");
    r.control.structure = control.Text("structure");
    r.control.rate_Hz = control.Positive("rate_Hz");
    r.control.kp_Nmprad = control.Numbers("kp_Nmprad", n);
    r.control.kd_Nmsprad = control.Numbers("kd_Nmsprad", n);
  }
  return r;
}

}  // namespace armcal::codegen
