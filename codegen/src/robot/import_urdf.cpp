// robot - guesses what a URDF does not say, and writes it down as guessed.
#include "codegen/src/robot/import_urdf.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <string_view>

#include "codegen/src/io/number_text.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {
namespace {

constexpr int kMostJoints = 7;
constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kGravity = 9.81;
// Guesses. A joint reaches its speed limit in a quarter of a second; a reading of torque is good to half a per cent of
// the limit; a two-hundredth of the speed limit is standstill.
constexpr double kSpeedUp_s = 0.25, kNoiseShare = 0.005, kStandstillShare = 0.005;
constexpr double kFastest_radps = 100, kFastest_mps = 20;  // a limit above stands for none
constexpr double kTurn_deg = 180, kTravel_m = 0.5, kSpeed_degps = 90, kSpeed_mps = 0.5;
// A body is doubtful that is narrower than this and heavier than that, or asks for this many times the torque limit.
constexpr double kNarrow_m = 0.003, kHeavy_kg = 1, kOverload = 10;
constexpr double kStrength = 2, kLeastTorque_Nm = 1;  // times what gravity asks for at most

std::string Short(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", v);
  std::string out = text;
  if (out.find_first_of(".e") == std::string::npos) out += ".0";
  return out;
}

// The name of a C++ struct comes from it, so it begins with a letter.
std::string Allowed(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    out += std::isalnum(static_cast<unsigned char>(lower)) ? lower : '_';
  }
  if (out.empty()) return "arm";
  return std::islower(static_cast<unsigned char>(out[0])) ? out : "arm_" + out;
}

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
  return "\"" + out + "\"";
}

// At most what gravity can ask of a joint: all that lies beyond it, on an arm that is stretched out.
double GravityTorque(const UrdfChain& chain, std::size_t joint) {
  const bool slide = chain.joint[joint].kinematics.type == JointType::kPrismatic;
  double reach = 0, torque = 0;
  for (std::size_t k = joint; k < chain.joint.size(); ++k) {
    const Joint& j = chain.joint[k];
    if (k > joint) reach += std::hypot(j.kinematics.a_m, j.kinematics.d_m);
    if (k > joint && j.kinematics.type == JointType::kPrismatic && chain.unlimited[k].empty())
      reach += std::max(std::abs(j.position_limit_rad[0]), std::abs(j.position_limit_rad[1]));
    const auto& c = j.link.center_m;
    torque += j.link.mass_kg * kGravity * (slide ? 1 : reach + std::hypot(c[0], c[1], c[2]));
  }
  return std::max(kLeastTorque_Nm, torque);
}

class Writer {
 public:
  Writer(const UrdfChain& chain, ImportedRobot& out) : chain_(chain), out_(out) {}

  void Joint(std::size_t j) {
    const codegen::Joint& joint = chain_.joint[j];
    const bool slide = joint.kinematics.type == JointType::kPrismatic;
    joint_ = joint.name;
    out_.text += "\n[[joint]]\nname = " + Escaped(joint.name) + "  # " + (slide ? "prismatic" : "revolute") + "\n";
    const double unit = slide ? 1 : kDegPerRad;
    Position(j, slide);
    double speed = joint.speed_limit_radps;
    const bool told = speed > 0 && speed <= (slide ? kFastest_mps : kFastest_radps);
    if (told) Comment(slide ? "speed_limit_mps" : "speed_limit_degps", Short(speed * unit));
    else {
      const std::string why =
          speed > 0 ? "the URDF has " + Short(speed) + (slide ? " m/s" : " rad/s") : "the URDF has none";
      speed = (slide ? kSpeed_mps : kSpeed_degps) / unit;
      Key(slide ? "speed_limit_mps" : "speed_limit_degps", Short(speed * unit), why);
    }
    double torque = joint.torque_limit_Nm;
    if (torque > 0) Comment(slide ? "torque_limit_N" : "torque_limit_Nm", Short(torque));
    else {
      torque = kStrength * GravityTorque(chain_, j);
      Key(slide ? "torque_limit_N" : "torque_limit_Nm", Short(torque),
          "the URDF has none: twice what gravity can ask of its bodies");
    }
    Key(slide ? "acceleration_limit_mps2" : "acceleration_limit_radps2", Short(speed / kSpeedUp_s),
        "to the speed limit in 0.25 s");
    Key(slide ? "torque_noise_N" : "torque_noise_Nm", Short(kNoiseShare * torque), "0.5 % of the torque limit");
    Key(slide ? "v_min_mps" : "v_min_radps", Short(kStandstillShare * speed), "0.5 % of the speed limit");
    const char* const friction = slide ? "coulomb_N, viscous_Nspm" : "coulomb_Nm, viscous_Nmsprad";
    out_.text += std::string("# ") + friction + ", motor: not stated, so friction and rotor inertia have wide priors\n";
  }

 private:
  void Comment(const std::string& key, const std::string& value) {
    out_.text += "# " + key + " = " + value + " in the URDF\n";
  }
  void Key(const std::string& key, const std::string& value, const std::string& why) {
    out_.text += key + " = " + value + "  # guessed: " + why + "\n";
    out_.guessed.push_back({joint_, key, value, why});
  }
  void Position(std::size_t j, bool slide) {
    const auto& found = chain_.joint[j].position_limit_rad;
    const std::string key = slide ? "position_limit_m" : "position_limit_deg";
    const double unit = slide ? 1 : kDegPerRad;
    if (chain_.unlimited[j].empty()) {
      Comment(key, "[" + Short(found[0] * unit) + ", " + Short(found[1] * unit) + "]");
      return;
    }
    const double half = slide ? kTravel_m : kTurn_deg;
    const bool guess = found[0] < found[1];
    Key(key,
        guess ? "[" + Short(found[0] * unit) + ", " + Short(found[1] * unit) + "]"
              : "[" + Short(-half) + ", " + Short(half) + "]",
        chain_.unlimited[j]);
  }

  const UrdfChain& chain_;
  ImportedRobot& out_;
  std::string joint_;
};

// A line for each body that can exist and hardly does: grams, or a placeholder.
std::vector<std::string> Doubtful(const UrdfChain& chain) {
  std::vector<std::string> lines;
  for (std::size_t j = 0; j < chain.joint.size(); ++j) {
    const Link& link = chain.joint[j].link;
    const double second = 0.5 * (link.inertia_kgm2[0] + link.inertia_kgm2[3] + link.inertia_kgm2[5]);
    const double width = link.mass_kg > 0 ? std::sqrt(second / link.mass_kg) : kNarrow_m;
    if (width < kNarrow_m && link.mass_kg > kHeavy_kg)
      lines.push_back("joint \"" + chain.joint[j].name + "\" moves " + Short(link.mass_kg) +
                      " kg with the inertia of a body of " + Short(1e3 * width) +
                      " mm: a mass in grams, or a placeholder? Its bodies count as good to 20 %");
    const double limit = chain.joint[j].torque_limit_Nm, gravity = GravityTorque(chain, j);
    if (limit > 0 && gravity > kOverload * limit && link.mass_kg > kHeavy_kg)
      lines.push_back("joint \"" + chain.joint[j].name + "\": gravity can ask for " + Short(gravity) +
                      " N m of what it moves, its limit is " + Short(limit) +
                      ": masses in grams, or a placeholder for the limit?");
    for (std::size_t k = 0; k < j; ++k)
      if (const Body& a = chain.part[k][0].body, &b = chain.part[j][0].body;
          a.mass > 0 && a.mass == b.mass && a.center == b.center && a.inertia == b.inertia)
        lines.push_back("links " + chain.part[k][0].link + " and " + chain.part[j][0].link +
                        " have the same inertia: equal parts, or a placeholder?");
  }
  return lines;
}

// Without bodies if those of the URDF are no prior; says why.
UrdfChain ReadWhatCanBeUsed(const UrdfChoice& choice, bool& bodies, std::vector<std::string>& said) {
  const UrdfChain chain = ReadUrdf(choice);
  bodies = chain.body_faults.empty();
  said.insert(said.end(), chain.body_faults.begin(), chain.body_faults.end());
  for (const auto& parts : chain.part)
    for (const UrdfPart& part : parts)
      if (HasInertiaOnly(part.body))
        said.push_back("link \"" + part.link + "\" has an inertia but no mass: it counts as a frame");
  if (!bodies) return chain;
  for (const std::string& line : Doubtful(chain)) said.push_back(line);
  for (const Joint& joint : chain.joint) {
    const Body body = ToBody(joint.link);
    const std::string missing = Impossible(body);
    if (missing.empty()) continue;
    const bool rounded = IsRounded(body);
    bodies = bodies && rounded;
    said.push_back("joint \"" + joint.name + "\": the body that it moves lacks " + missing +
                   (rounded ? "; the nearest body that can exist is taken" : ""));
  }
  if (chain.same_inertia.empty()) return chain;
  bodies = false;
  std::string names;
  for (const std::string& name : chain.same_inertia) names += (names.empty() ? "" : ", ") + name;
  said.push_back("links " + names + " have the same inertia, which nobody can have computed");
  return chain;
}

// A line for each package, or path, whose meshes are not there.
std::vector<std::string> MissingMeshes(const UrdfChain& chain) {
  std::vector<std::string> lines;
  std::map<std::string, std::vector<std::string>> missing;  // package, or the whole name -> links
  constexpr std::string_view kPackage = "package://";
  for (const Shape& shape : chain.shape) {
    if (shape.kind != Shape::Kind::kMesh || !shape.file.empty()) continue;
    const bool package = shape.mesh.starts_with(kPackage);
    missing[package ? shape.mesh.substr(0, shape.mesh.find('/', kPackage.size())) : shape.mesh].push_back(shape.link);
  }
  for (const auto& [name, links] : missing) {
    std::string list;
    for (const std::string& link : links) list += (list.empty() ? "" : ", ") + link;
    const bool package = name.starts_with(kPackage);
    lines.push_back(name + " was not found, with the collision mesh of " + list + ": collisions cannot be checked; " +
                    (package ? "say where it is: --package " + name.substr(kPackage.size()) + "=FOLDER"
                             : "expected the file beside the URDF"));
  }
  return lines;
}

}  // namespace

ImportedRobot ImportUrdf(const UrdfChoice& asked, const std::string& name, const std::filesystem::path& file) {
  ImportedRobot out;
  out.choice = ChooseChain(asked, out.said);
  bool bodies = true;
  const UrdfChain chain = ReadWhatCanBeUsed(out.choice, bodies, out.said);
  if (chain.joint.size() > kMostJoints) {
    std::string names;
    for (const Joint& joint : chain.joint) names += (names.empty() ? "" : ", ") + joint.name;
    throw io::InputError(asked.path.string() + ": " + std::to_string(chain.joint.size()) + " movable joints (" + names +
                         "), expected at most 7; name an end nearer to the base with --tip, or hold a joint with "
                         "--fixed");
  }
  for (const std::string& line : MissingMeshes(chain)) out.said.push_back(line);
  const std::filesystem::path folder = std::filesystem::absolute(file).lexically_normal().parent_path();
  const auto from_file = [&folder](const std::filesystem::path& path) {
    return std::filesystem::absolute(path).lexically_normal().lexically_proximate(folder).string();
  };
  out.text = "# Made by armcal import. What is marked as guessed is not in the URDF: state it where you know it.\n";
  out.text += "name = \"" + Allowed(name) + "\"\nsource = " +
              Escaped("kinematics, bodies, limits: " + asked.path.filename().string() + "; guessed: marked below") +
              "\nurdf = " + Escaped(from_file(asked.path)) + "\n";
  if (!out.choice.tip.empty()) out.text += "tip = " + Escaped(out.choice.tip) + "  # the arm ends at this link\n";
  if (!out.choice.fixed.empty()) {
    std::string list;
    for (const auto& [joint, position] : out.choice.fixed)
      list += (list.empty() ? "" : ", ") + Escaped(joint) + " = " + io::NumberText(position);
    out.text += "fixed = { " + list + " }  # joints that are held, rad or m: parts of the body that carries them\n";
  }
  if (!asked.packages.empty()) {
    std::string list;
    for (const auto& [package, path] : asked.packages)
      list += (list.empty() ? "" : ", ") + Escaped(package) + " = " + Escaped(from_file(path));
    out.text += "packages = { " + list + " }  # where the URDF's packages lie\n";
  }
  out.text +=
      "gravity_mps2 = [0.0, 0.0, -9.81]  # guessed: the URDF's z axis points up\n"
      "tick_rate_Hz = 1000  # guessed: of the controller\nsample_ticks = 8\n";
  out.guessed.push_back({"", "gravity_mps2", "[0.0, 0.0, -9.81]", "the URDF's z axis points up"});
  out.guessed.push_back({"", "tick_rate_Hz", "1000", "of the controller; a log has its own rate"});
  if (bodies) {
    out.text +=
        "\n[prior]\nlink_relative_sd = 0.2  # guessed: how far the URDF's masses, centres and inertias may be off\n";
    out.guessed.push_back({"", "prior.link_relative_sd", "0.2", "how far the URDF's bodies may be off"});
    out.guessed.push_back({"", "friction, rotor inertia", "wide priors", "from each joint's torque and speed limits"});
  } else {
    out.text += "prior = \"none\"  # the URDF's bodies cannot be used: see what armcal import said\n";
    out.guessed.push_back({"", "prior", "\"none\"", "the URDF's bodies cannot be used"});
  }
  Writer writer(chain, out);
  for (std::size_t j = 0; j < chain.joint.size(); ++j) {
    out.joints.push_back(chain.joint[j].name);
    writer.Joint(j);
  }
  return out;
}

}  // namespace armcal::codegen
