// robot - reads a robot file and checks every number.
#include "codegen/src/robot/robot.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <numbers>

#include "codegen/src/io/file_kind.hpp"
#include "codegen/src/io/toml_reader.hpp"
#include "codegen/src/robot/body.hpp"
#include "codegen/src/robot/frames.hpp"
#include "codegen/src/robot/payload.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// What a [[joint]] table may say of the drive. A key of the other kind of joint is refused.
constexpr std::string_view kTurnKeys[] = {"name",
                                          "position_limit_deg",
                                          "speed_limit_degps",
                                          "acceleration_limit_radps2",
                                          "torque_limit_Nm",
                                          "torque_noise_Nm",
                                          "v_min_radps",
                                          "coulomb_Nm",
                                          "viscous_Nmsprad",
                                          "encoder",
                                          "motor"};
constexpr std::string_view kSlideKeys[] = {"name",
                                           "position_limit_m",
                                           "speed_limit_mps",
                                           "acceleration_limit_mps2",
                                           "torque_limit_N",
                                           "torque_noise_N",
                                           "v_min_mps",
                                           "coulomb_N",
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
  constexpr std::int64_t kWord = std::int64_t{1} << 32;  // an encoder may be read with or without a sign
  m.zero_counts =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(encoder.Integer("zero_counts", -kWord / 2, kWord - 1, 0)));
  m.gear_ratio = motor.Number("gear_ratio");
  if (m.gear_ratio == 0)
    motor.Report("gear_ratio", prismatic ? "motor radians per metre, not zero" : "a ratio, not zero");
  m.current_A_per_lsb = motor.Positive("current_A_per_lsb");
  m.torque_constant_NmpA = motor.Positive("torque_constant_NmpA");
  m.torque_constant_tolerance = motor.NotNegative("torque_constant_tolerance", 0);
  m.rotor_inertia_kgm2 = motor.NotNegative("rotor_inertia_kgm2", 0);
  return m;
}

// What stands for a motor that the file does not have: 2^23 counts a turn or 1e7 a metre, and 2^14 steps of the
// converter up to the torque limit, all on the joint side. The simulated drive measures so, and the client reads so.
Motor OnTheJoint(JointType type, double torque_limit_Nm) {
  Motor motor;
  motor.counts_per_turn = type == JointType::kPrismatic ? 2 * std::numbers::pi * 1e7 : 8388608;
  motor.gear_ratio = motor.torque_constant_NmpA = 1;
  motor.current_A_per_lsb = torque_limit_Nm / 16384;
  return motor;
}

void AllowDriveKeys(const io::TomlReader& in, JointType type, std::span<const std::string_view> more = {}) {
  if (type == JointType::kPrismatic) in.AllowOnly(kSlideKeys, more);
  else in.AllowOnly(kTurnKeys, more);
}

// Numbers of the table stand before those that j holds of a URDF. unlimited: why that has no position limits.
void ReadDrive(const io::TomlReader& in, Joint& j, const std::string& unlimited) {
  const bool prismatic = j.kinematics.type == JointType::kPrismatic;
  const char* const position = prismatic ? "position_limit_m" : "position_limit_deg";
  const char* const speed = prismatic ? "speed_limit_mps" : "speed_limit_degps";
  const char* const torque = prismatic ? "torque_limit_N" : "torque_limit_Nm";
  const bool urdf = !j.wide.empty();
  if (urdf && !unlimited.empty() && !in.Has(position)) {
    in.Report(position, std::string("[lower, upper] in ") + (prismatic ? "m" : "degrees") + ", for " + unlimited);
  } else if (!urdf || in.Has(position)) {
    const auto limits = in.Numbers(position, 2);
    for (int k = 0; k < 2; ++k) j.position_limit_rad[k] = prismatic ? limits[k] : limits[k] * kRadPerDeg;
    if (j.position_limit_rad[0] >= j.position_limit_rad[1]) in.Report(position, "[lower, upper] with lower < upper");
    if (prismatic && j.position_limit_rad[1] - j.position_limit_rad[0] > kLongestTravel)
      in.Report(position, "metres (millimetres?)");
  }
  if (!(j.speed_limit_radps > 0) || in.Has(speed))
    j.speed_limit_radps = prismatic ? in.Positive(speed) : in.Positive(speed) * kRadPerDeg;
  if (!(j.torque_limit_Nm > 0) || in.Has(torque)) j.torque_limit_Nm = in.Positive(torque);
  j.acceleration_limit_radps2 = in.Positive(prismatic ? "acceleration_limit_mps2" : "acceleration_limit_radps2");
  j.torque_noise_Nm = in.Positive(prismatic ? "torque_noise_N" : "torque_noise_Nm");
  j.v_min_radps = in.Positive(prismatic ? "v_min_mps" : "v_min_radps");
  const std::pair<const char*, const char*> friction[] = {{"Fc", prismatic ? "coulomb_N" : "coulomb_Nm"},
                                                          {"Fv", prismatic ? "viscous_Nspm" : "viscous_Nmsprad"}};
  for (const auto& [name, key] : friction) {
    j.nominal[name] = in.NotNegative(key, j.nominal[name]);
    if (in.Has(key)) j.wide.erase(name);
  }
  j.has_motor = in.Has("motor");
  if (!j.has_motor && in.Has("encoder")) in.Report("encoder", "motor beside it");
  j.motor = j.has_motor ? ReadMotor(in, prismatic) : OnTheJoint(j.kinematics.type, j.torque_limit_Nm);
  if (!j.has_motor) return;
  if (in.Table("motor").Has("rotor_inertia_kgm2")) j.wide.erase("Ia");
}

CeilingSettings ReadCeilings(const io::TomlReader& in, int joints) {
  CeilingSettings c;
  in.AllowOnly({"torque_Nm", "friction_Nm", "noise_Nm", "torque_scale", "temperature_degC", "feed_share",
                "least_fade_ms", "longest_fade_ms", "least_forgetting", "parameter"});
  const auto each = [&](std::string_view key, std::vector<double>& values) {
    if (!in.Has(key)) return;
    values = in.Numbers(key, static_cast<std::size_t>(joints));
    if (std::any_of(values.begin(), values.end(), [](double v) { return v <= 0; }))
      in.Report(key, "numbers above zero, one a joint");
  };
  const auto range = [](const io::TomlReader& from, std::string_view key, std::array<double, 2>& values) {
    if (!from.Has(key)) return;
    const auto given = from.Numbers(key, 2);
    if (given[0] > given[1]) from.Report(key, "[lowest, highest]");
    values = {given[0], given[1]};
  };
  each("torque_Nm", c.torque_Nm);
  each("friction_Nm", c.friction_Nm);
  each("noise_Nm", c.noise_Nm);
  range(in, "torque_scale", c.torque_scale);
  if (c.torque_scale[0] <= 0) in.Report("torque_scale", "[lowest, highest] above zero");
  range(in, "temperature_degC", c.temperature_degC);
  c.feed_share = in.NotNegative("feed_share", c.feed_share);
  c.least_fade_ms = in.Positive("least_fade_ms", c.least_fade_ms);
  c.longest_fade_ms = in.Positive("longest_fade_ms", c.longest_fade_ms);
  if (c.longest_fade_ms < c.least_fade_ms || c.longest_fade_ms > 1e6)
    in.Report("longest_fade_ms", "least_fade_ms to 1000000");
  c.least_forgetting = in.Positive("least_forgetting", c.least_forgetting);
  if (c.least_forgetting > 1) in.Report("least_forgetting", "a number above 0 and not above 1");
  if (!in.Has("parameter")) return c;
  const io::TomlReader parameter = in.Table("parameter");
  for (const auto& [key, value] : parameter.table()) range(parameter, key.str(), c.parameter[std::string(key.str())]);
  return c;
}

Joint ReadJoint(const io::TomlReader& in, bool has_prior) {
  Joint j;
  const std::string type = in.Text("type");
  if (!type.empty() && type != "revolute" && type != "prismatic") in.Report("type", "\"revolute\" or \"prismatic\"");
  // A wrong word makes one fault, not one for each key of the other kind.
  const bool prismatic = type == "prismatic" || (type != "revolute" && in.Has("position_limit_m"));
  j.kinematics.type = prismatic ? JointType::kPrismatic : JointType::kRevolute;
  const std::string_view body[] = {"type", "alpha_deg", "a_m", "d_m", "offset_deg", "offset_m", "link"};
  AllowDriveKeys(in, j.kinematics.type, body);
  j.name = in.Text("name");
  j.kinematics.alpha_rad = in.Number("alpha_deg") * kRadPerDeg;
  j.kinematics.a_m = in.Number("a_m");
  j.kinematics.d_m = in.Number("d_m") + (prismatic ? in.Number("offset_m", 0) : 0);
  j.kinematics.theta_rad = in.Number("offset_deg", 0) * kRadPerDeg;
  if (!prismatic && in.Has("offset_m")) in.Report("offset_m", "a joint that slides; one that turns has offset_deg");
  for (const char* key : {"a_m", "d_m"})
    if (std::abs(in.Number(key)) > kLongest) in.Report(key, "metres (millimetres?)");
  ReadDrive(in, j, "");
  if (!has_prior) return j;
  const io::TomlReader link = in.Table("link");
  link.AllowOnly({"mass_kg", "center_m", "inertia_kgm2"});
  j.link.mass_kg = link.Positive("mass_kg");
  const auto center = link.Numbers("center_m", 3), inertia = link.Numbers("inertia_kgm2", 6);
  std::copy(center.begin(), center.end(), j.link.center_m.begin());
  std::copy(inertia.begin(), inertia.end(), j.link.inertia_kgm2.begin());
  const Body all{j.link.mass_kg, Eigen::Vector3d(center.data()), Symmetric(j.link.inertia_kgm2)};
  if (all.center.norm() > kLongest) link.Report("center_m", "metres (millimetres?)");
  if (all.inertia.allFinite() && all.mass > 0)
    if (const std::string missing = Impossible(all, kPublished); !missing.empty()) in.Report("link", missing);
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

UrdfChoice ReadUrdfChoice(const io::TomlReader& in) {
  UrdfChoice choice;
  choice.path = std::filesystem::path(in.file()).parent_path() / in.Text("urdf");
  choice.tip = in.Text("tip", "");
  if (!in.Has("fixed")) return choice;
  const io::TomlReader fixed = in.Table("fixed");
  for (const auto& [joint, position] : fixed.table())
    choice.fixed[std::string(joint.str())] = fixed.Number(joint.str());
  return choice;
}

// Where packages of the URDF's meshes lie, seen from the robot file.
void ReadPackages(const io::TomlReader& in, UrdfChoice& choice) {
  if (!in.Has("packages")) return;
  const io::TomlReader packages = in.Table("packages");
  for (const auto& [name, path] : packages.table())
    choice.packages[std::string(name.str())] =
        std::filesystem::path(in.file()).parent_path() / packages.Text(name.str());
}

// A capsule from one point to another, in the frame of the link: in a URDF its own, else that of center_m, or the base.
Shape ReadCapsule(const io::TomlReader& in, const UrdfChain* chain, int joints) {
  in.AllowOnly({"link", "from_m", "to_m", "radius_m"});
  Shape shape;
  shape.kind = Shape::Kind::kCapsule;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  if (chain) {
    shape.link = in.Text("link");
    std::vector<std::string> known;
    const auto look = [&](const std::vector<UrdfPart>& parts, std::size_t body) {
      for (const UrdfPart& part : parts) {
        known.push_back(part.link);
        if (part.link == shape.link) shape.body = static_cast<int>(body), frame = part.pose;
      }
    };
    look(chain->base_part, 0);
    for (std::size_t k = 0; k < chain->part.size(); ++k) look(chain->part[k], k + 1);
    if (std::find(known.begin(), known.end(), shape.link) == known.end()) {
      const std::string nearest = io::Nearest(shape.link, known);
      in.Report("link", "a link of the arm" + (nearest.empty() ? "" : "; the nearest is " + nearest));
    }
  } else {
    shape.body = static_cast<int>(in.Integer("link", 0, joints));
    shape.link = shape.body == 0 ? "base" : "link " + std::to_string(shape.body);
  }
  const Eigen::Vector3d from(in.Numbers("from_m", 3).data()), to(in.Numbers("to_m", 3).data());
  shape.size_m = {in.Positive("radius_m"), (to - from).norm()};
  for (const char* key : {"from_m", "to_m", "radius_m"})
    if (std::max({from.norm(), to.norm(), shape.size_m[0]}) > kLongest) in.Report(key, "metres (millimetres?)");
  shape.xyz_m = Components((from + to) / 2);
  shape.rotation = RowMajor(TurnFromZ(to - from));
  return Moved(frame, shape);
}

// Capsules stand in the place of the URDF's shapes of their links. base: the URDF's root link, seen from the base
// frame.
void ReadShapes(const io::TomlReader& in, Robot& r, const UrdfChain* chain, const Eigen::Isometry3d& base) {
  std::vector<Shape> capsules;
  for (const io::TomlReader& capsule : in.Tables("capsule"))
    capsules.push_back(ReadCapsule(capsule, chain, r.joints()));
  if (chain)
    for (const Shape& shape : chain->shape)
      if (std::none_of(capsules.begin(), capsules.end(), [&](const Shape& c) { return c.link == shape.link; }))
        r.shape.push_back(shape);
  r.shape.insert(r.shape.end(), capsules.begin(), capsules.end());
  if (chain)
    for (Shape& shape : r.shape)
      if (shape.body == 0) shape = Moved(base, shape);
}

// The bodies of a URDF as a prior: there, possible, and more than a placeholder.
void CheckUrdfBodies(const io::TomlReader& in, const UrdfChain& chain, io::Faults& faults) {
  const std::string file = (std::filesystem::path(in.file()).parent_path() / in.Text("urdf")).string();
  const std::string remedy = "; mend it, or write prior = \"none\" in " + in.file();
  for (const std::string& line : chain.body_faults) faults.Add(line + remedy);
  for (std::size_t j = 0; j < chain.joint.size(); ++j) {
    const Link& link = chain.joint[j].link;
    const Body body = ToBody(link);
    const std::string who = file + ": joint \"" + chain.joint[j].name + "\": expected ";
    const bool frames = std::all_of(chain.part[j].begin(), chain.part[j].end(),
                                    [](const UrdfPart& part) { return part.body.mass == 0; });
    if (frames) faults.Add(who + "a link with mass after it" + remedy);
    else if (const std::string missing = Impossible(body, kPublished); !missing.empty() && chain.body_faults.empty())
      faults.Add(who + "to move a body with " + missing + remedy);
  }
  std::string names;
  for (const std::string& name : chain.same_inertia) names += (names.empty() ? "" : ", ") + name;
  if (!names.empty() && !in.Has("prior"))
    faults.Add(file + ": links " + names +
               ": expected inertias of their own, but they are the same: placeholders? Write in " + in.file() +
               " either prior = \"none\", or [prior] with link_relative_sd, how far they may be off");
}

// Kinematics, bodies and limits from the URDF; one [[joint]] table per movable joint, found by its name, says the rest.
void ReadUrdfRobot(const io::TomlReader& in, Robot& r, UrdfChain& chain, io::Faults& faults) {
  if (in.Has("dh")) in.Report("dh", "either dh or urdf");
  r.urdf = ReadUrdfChoice(in);
  ReadPackages(in, r.urdf);
  if (!faults.Try([&] { chain = ReadUrdf(r.urdf); })) return;
  if (r.has_prior) CheckUrdfBodies(in, chain, faults);
  r.joint = chain.joint;
  std::vector<std::string> untold;
  for (const Joint& joint : r.joint) untold.push_back(joint.name);
  for (const io::TomlReader& table : in.Tables("joint")) {
    const std::string name = table.Text("name");
    const auto at = std::find(untold.begin(), untold.end(), name);
    if (at == untold.end()) {
      const std::string nearest = io::Nearest(name, untold);
      table.Report("name", "the name of a movable joint of the URDF, once" +
                               (nearest.empty() ? "" : "; the nearest is " + nearest));
      if (!nearest.empty()) untold.erase(std::find(untold.begin(), untold.end(), nearest));
      continue;
    }
    untold.erase(at);
    std::size_t j = 0;
    while (r.joint[j].name != name) ++j;
    AllowDriveKeys(table, r.joint[j].kinematics.type);
    ReadDrive(table, r.joint[j], chain.unlimited[j]);
  }
  for (const std::string& name : untold) in.Report("joint", "a [[joint]] table with name = \"" + name + "\"");
}

std::vector<int> ReadBodyParameters(const io::TomlReader& in, std::string_view key, int joints) {
  std::vector<int> out;
  for (const std::string& name : in.Texts(key)) {
    int found = -1;
    for (int c = 0; c < 11 * joints; ++c)
      if (name == kBodyParameterName[c % 11] + std::to_string(c / 11 + 1)) found = c;
    if (found < 0) in.Report(key, "body parameters m1, mx1 ... Ia" + std::to_string(joints) + ", not \"" + name + "\"");
    else out.push_back(found);
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
    in.Report("state", "\"estimated\", \"standby\", \"fixed\" or \"considered\"");
  if (in.Has("joints"))
    for (const double j : in.Numbers("joints")) {
      if (j >= 1 && j <= joints && j == std::floor(j)) use.joints.push_back(static_cast<int>(j) - 1);
      else in.Report("joints", "joint numbers 1.." + std::to_string(joints));
    }
  for (const auto* key : {"mean", "nonlinear"}) {
    if (!in.Has(key)) continue;
    const io::TomlReader values = in.Table(key);
    auto& target = std::string_view(key) == "mean" ? use.mean : use.nonlinear;
    for (const auto& [k, v] : values.table()) target[std::string(k.str())] = values.Number(k.str());
  }
  return use;
}

void ReadPrior(const io::TomlReader& in, Robot& r) {
  if (!in.Has("prior")) return;
  if (in.table()["prior"].is_string()) {
    if (in.Text("prior") != "none") in.Report("prior", "\"none\" or a table");
    r.has_prior = false;
    return;
  }
  const io::TomlReader prior = in.Table("prior");
  prior.AllowOnly({"link_relative_sd", "center_floor_m", "inertia_floor_ratio", "friction_relative_sd"});
  r.link_relative_sd = prior.NotNegative("link_relative_sd", r.link_relative_sd);
  r.center_floor_m = prior.NotNegative("center_floor_m", r.center_floor_m);
  r.inertia_floor_ratio = prior.NotNegative("inertia_floor_ratio", r.inertia_floor_ratio);
  r.friction_relative_sd = prior.NotNegative("friction_relative_sd", r.friction_relative_sd);
}

// What stands before the joints.
void ReadHead(const io::TomlReader& in, Robot& r) {
  in.AllowOnly(
      {"name",           "title",        "source",       "gravity_mps2", "dh",      "sign_law", "sign_width_radps",
       "sign_width_mps", "tick_rate_Hz", "sample_ticks", "prior",        "control", "joint",    "effect",
       "coupling",       "base_frame",   "tool_frame",   "urdf",         "tip",     "fixed",    "parameters",
       "payload",        "ceilings",     "packages",     "capsule"});
  r.name = in.Text("name");
  if (in.Has("name") && (r.name.empty() || !std::islower(static_cast<unsigned char>(r.name[0])) ||
                         r.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos))
    in.Report("name", "a lower-case letter, then lower-case letters, digits and _");
  r.title = in.Text("title", r.name);
  if (std::any_of(r.title.begin(), r.title.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }))
    in.Report("title", "one line of text");
  r.source = in.Text("source");
  const auto gravity = in.Numbers("gravity_mps2", 3);
  std::copy(gravity.begin(), gravity.end(), r.gravity_mps2.begin());
  r.sign_law = in.Text("sign_law", "sgn");
  if (r.sign_law != "sgn" && r.sign_law != "tanh") in.Report("sign_law", "\"sgn\" or \"tanh\"");
  if (r.sign_law == "tanh")
    r.sign_width_radps = in.Has("sign_width_mps") ? in.Positive("sign_width_mps") : in.Positive("sign_width_radps");
  r.tick_rate_Hz = in.Number("tick_rate_Hz", 1000);
  if (r.tick_rate_Hz <= 0) in.Report("tick_rate_Hz", "a number above zero");
  r.sample_ticks = static_cast<int>(in.Integer("sample_ticks", 1, 64, 8));
  ReadPrior(in, r);
  if (!in.Has("urdf"))
    for (const char* key : {"tip", "fixed", "packages"})
      if (in.Has(key)) in.Report(key, "urdf beside it: it chooses a chain of a URDF");
}

// Other files that people give as a robot file.
void RefuseOtherFiles(const std::filesystem::path& path) {
  std::ifstream file(path);
  char first = 0;
  file >> first;
  if (path.extension() != ".urdf" && path.extension() != ".xacro" && first != '<') return;
  const std::string stem = path.stem().stem().string();
  throw io::InputError(path.string() + ": is a URDF, expected a robot file; armcal makes one: armcal import " +
                       path.string() + " -o " + stem + ".toml");
}

void ReadPayloadOf(const io::TomlReader& in, Robot& r, const Eigen::Isometry3d& flange, io::Faults& faults) {
  if (!r.has_prior) in.Report("payload", "links with bodies to carry it; prior = \"none\" leaves them out");
  const io::TomlReader clamped = in.Table("payload");
  Payload payload;
  if (!faults.Try([&] { payload = ReadPayload(clamped); })) return;
  if (!payload.inertia_kgm2) clamped.Report("inertia_kgm2", "6 numbers");
  if (faults.empty()) r.joint.back().link = Carrying(r.joint.back().link, flange, payload);
}

}  // namespace

Robot ReadRobot(const std::filesystem::path& path) {
  if (std::filesystem::is_regular_file(path)) RefuseOtherFiles(path);
  const toml::table table = io::ParseToml(path);
  if (table.empty()) throw io::InputError(path.string() + ": nothing in it, expected a robot file");
  io::RequireKind(table, path, io::FileKind::kRobot);
  io::Faults faults;
  const io::TomlReader in(table, path.string(), "", &faults);
  Robot r;
  r.path = path.string();
  ReadHead(in, r);
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity(), flange = base, root = base;
  UrdfChain chain;
  bool chain_known = true;
  if (in.Has("urdf")) {
    ReadUrdfRobot(in, r, chain, faults);
    base = chain.base, flange = chain.flange;
    chain_known = !r.joint.empty();
  } else {
    const std::string dh = in.Text("dh");
    if (!dh.empty() && dh != "modified" && dh != "standard") in.Report("dh", "\"modified\" or \"standard\"");
    for (const io::TomlReader& joint : in.Tables("joint")) r.joint.push_back(ReadJoint(joint, r.has_prior));
    if (dh == "standard") flange = ConvertStandardDh(r.joint);
  }
  const int n = r.joints();
  if (chain_known && (n < 1 || n > 7)) in.Report("joint", "1 to 7 [[joint]] tables");
  if (chain_known && in.Has("coupling")) {
    const io::TomlReader coupling = in.Table("coupling");
    coupling.AllowOnly({"matrix"});
    r.coupling = coupling.Numbers("matrix", n * n);
    if (static_cast<int>(r.coupling.size()) == n * n &&
        !Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(Eigen::MatrixXd::Map(r.coupling.data(), n, n)).isInvertible())
      coupling.Report("matrix", "a matrix that has an inverse");
  }
  if (in.Has("base_frame")) root = ReadFrame(in.Table("base_frame"));
  base = root * base;
  if (in.Has("tool_frame")) flange = flange * ReadFrame(in.Table("tool_frame"));
  r.base_xyz_m = Components(base.translation()), r.base_rotation = RowMajor(base.linear());
  r.tool_xyz_m = Components(flange.translation()), r.tool_rotation = RowMajor(flange.linear());
  if (chain_known) ReadShapes(in, r, in.Has("urdf") ? &chain : nullptr, root);
  if (in.Has("payload")) ReadPayloadOf(in, r, flange, faults);
  if (chain_known && in.Has("parameters")) {
    const io::TomlReader set = in.Table("parameters");
    set.AllowOnly({"set", "prefer", "omit"});
    const std::string kind = set.Text("set", "base");
    if (kind != "base" && kind != "standard") set.Report("set", "\"base\" or \"standard\"");
    r.parameters = {kind == "standard", ReadBodyParameters(set, "prefer", n), ReadBodyParameters(set, "omit", n)};
  }
  if (chain_known && in.Has("ceilings")) r.ceilings = ReadCeilings(in.Table("ceilings"), n);
  if (chain_known)
    for (const io::TomlReader& use : in.Tables("effect")) r.effect.push_back(ReadEffectUse(use, n));
  if (chain_known && in.Has("control")) {
    const io::TomlReader control = in.Table("control");
    control.AllowOnly({"structure", "rate_Hz", "kp_Nmprad", "kd_Nmsprad"});
    r.control.structure = control.Text("structure");
    if (!r.control.structure.empty() && r.control.structure != "pd_feedforward")
      control.Report("structure", "\"pd_feedforward\"");
    r.control.rate_Hz = control.Positive("rate_Hz");
    r.control.kp_Nmprad = control.Numbers("kp_Nmprad", n);
    r.control.kd_Nmsprad = control.Numbers("kd_Nmsprad", n);
  }
  faults.ThrowIfAny();
  // A stated uncertainty counts for the URDF's friction, too; a rotor that the user leaves out is not there.
  const bool friction_stated = in.Has("prior") && in.table()["prior"]["friction_relative_sd"];
  for (Joint& joint : r.joint)
    if (friction_stated) joint.wide.erase("Fc"), joint.wide.erase("Fv");
  for (const int omitted : r.parameters.omit)
    if (omitted % 11 == 10) r.joint[static_cast<std::size_t>(omitted) / 11].wide.erase("Ia");
  return r;
}

}  // namespace armcal::codegen
