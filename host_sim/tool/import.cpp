// tool - armcal import: makes a robot file of a URDF, and says what it guessed.
#include <fmt/core.h>

#include "codegen/src/robot/import_urdf.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/identify/collision/clearance.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct ImportOptions {
  std::string urdf, tip, name, out, json;
  std::vector<std::string> fixed, packages;
  bool overwrite = false;
};

// "finger=0.02", or "finger" for zero.
std::map<std::string, double> Held(const std::vector<std::string>& words) {
  std::map<std::string, double> held;
  for (const std::string& word : words) {
    const auto equals = word.rfind('=');
    double position = 0;
    if (equals != word.npos) {
      std::size_t used = 0;
      const std::string number = word.substr(equals + 1);
      try {
        position = std::stod(number, &used);
      } catch (const std::exception&) {
        used = 0;
      }
      if (used == 0 || used != number.size())
        throw io::InputError("--fixed " + word + ": expected JOINT or JOINT=POSITION, in rad or m");
    }
    held[word.substr(0, equals)] = position;
  }
  return held;
}

std::map<std::string, std::filesystem::path> Packages(const std::vector<std::string>& words) {
  std::map<std::string, std::filesystem::path> packages;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    if (equals == word.npos || equals == 0) throw io::InputError("--package " + word + ": expected NAME=FOLDER");
    const std::string folder = word.substr(equals + 1);
    if (!std::filesystem::is_directory(folder))
      throw io::InputError("--package " + word + ": " + folder + " is no folder; expected NAME=FOLDER");
    packages[word.substr(0, equals)] = folder;
  }
  return packages;
}

std::string StemOf(const std::filesystem::path& path) {  // arm of arm.urdf.xacro
  return path.extension() == ".xacro" ? path.stem().stem().string() : path.stem().string();
}

void PrintGuesses(const codegen::ImportedRobot& robot) {
  for (const std::string& line : robot.said) fmt::print("{}\n", line);
  fmt::print("guessed, since no URDF says it; state in the file what you know:\n");
  report::Table t{{"joint", "key", "value", "why"}, {}};
  for (const codegen::Guess& g : robot.guessed)
    t.rows.push_back({g.joint.empty() ? "(arm)" : g.joint, g.key, g.value, g.why});
  fmt::print("{}", report::Text(t));
}

int Run(const ImportOptions& o) {
  const std::string name = o.name.empty() ? StemOf(o.out.empty() ? o.urdf : o.out) : o.name;
  const std::filesystem::path out = o.out.empty() ? StemOf(o.urdf) + ".toml" : o.out;
  if (std::filesystem::exists(out) && !o.overwrite)
    throw io::InputError(out.string() + ": is there already; --overwrite replaces it");
  codegen::ImportedRobot robot = codegen::ImportUrdf({o.urdf, o.tip, Held(o.fixed), Packages(o.packages)}, name, out);
  files::WriteWholeFile(out, robot.text);
  const codegen::Robot read = codegen::ReadRobot(out);
  for (const std::string& fault : collision::MeshFaults(read))
    robot.said.push_back(fault + ": collisions cannot be checked");
  PrintGuesses(robot);
  fmt::print("the arm's joints: {}{}\n", fmt::join(robot.joints, ", "),
             robot.choice.tip.empty() ? "" : "; it ends at link " + robot.choice.tip);
  fmt::print("{}: {} joints, {}\nnext: armcal excite --robot {} --out train.csv\n", out.string(), read.joints(),
             read.has_prior ? "bodies from the URDF" : "no bodies: prior = \"none\"", out.string());
  nlohmann::ordered_json json{{"file", out.string()},    {"robot", read.name},          {"joints", robot.joints},
                              {"tip", robot.choice.tip}, {"fixed", robot.choice.fixed}, {"prior", read.has_prior}};
  json["said"] = robot.said;
  for (const codegen::Guess& g : robot.guessed)
    json["guessed"].push_back({{"joint", g.joint}, {"key", g.key}, {"value", g.value}, {"why", g.why}});
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddImport(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "import",
      "make a robot file of a URDF\nexample: armcal import arm.urdf --tip tool0 --fixed finger=0.02 -o my_arm.toml");
  auto o = std::make_shared<ImportOptions>();
  verb->add_option("urdf", o->urdf, "the URDF, or a .xacro file if the program xacro is installed")->required();
  verb->add_option("--tip", o->tip, "link at which the arm ends; joints that do not lead there are held");
  verb->add_option("--fixed", o->fixed, "JOINT or JOINT=POSITION (rad, m): held there; may be repeated");
  verb->add_option("--package", o->packages,
                   "NAME=FOLDER: where package://NAME/.. of the URDF lies; ROS_PACKAGE_PATH serves, too");
  verb->add_option("--name", o->name, "the robot's name (default: that of the file)");
  verb->add_option("-o,--out", o->out, "robot file to write (default: the URDF's name with .toml)");
  verb->add_flag("--overwrite", o->overwrite, "write it although it is there");
  verb->add_option("--json", o->json, "write joints, choices and guesses here");
  verb->callback([o, &action] { action = [o] { return Run(*o); }; });
}

}  // namespace armcal::tool
