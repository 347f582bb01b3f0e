// tool - armcal simulate: starts the simulated drive of a robot. If none was built with armcal, it compiles one.
#include <fmt/core.h>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/atomic_write.hpp"
#include "host_sim/machine/plant/robot_file.hpp"
#include "host_sim/machine/plant/scenario.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/compiled_firmware.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

namespace fs = std::filesystem;

struct SimulateOptions {
  std::string scenario = "any", robot = "er20_like", drive, storage = "build/drive.nor", truth_log, serial, key, json;
  int port = kSimulatedPort, read_port = -1;
  bool real_time = false;
};

// The program that was built with armcal for this model, or the one for all with a firmware from the cache.
std::vector<std::string> DriveFor(const codegen::Model& model) {
  const fs::path folder = fs::path(OwnProgram()).parent_path(), own = folder / ("armcal-drive-" + model.robot().name),
                 any = folder / "armcal-drive";
  if (fs::is_regular_file(own)) {
    Background program({own.string(), "--schema"});
    program.Wait();
    if (program.first_line() == fmt::format("{:08X}", codegen::Schema(model))) return {own.string()};
  }
  if (!fs::is_regular_file(any)) throw io::InputError(any.string() + ": not there; build all of armcal");
  return {any.string(), "--firmware", CompiledFirmware(model, FirmwarePart::kDrive).string()};
}

int RunSimulate(const SimulateOptions& o) {
  const fs::path robot = RobotPath(o.robot);
  const fs::path scenario = ScenarioPath(o.scenario);
  if (!o.drive.empty() && !fs::is_regular_file(o.drive)) throw io::InputError(o.drive + ": no such program");
  if (const auto folder = fs::path(o.storage).parent_path(); !folder.empty()) io::MakeFolder(folder);
  const codegen::Robot arm = codegen::ReadRobot(robot);
  // Before anything is compiled: the scenario is of this arm, and the arm can be simulated.
  plant::RequireRobot(plant::ReadScenario(scenario.string()), arm.name, robot.string());
  plant::ReadRobotFile(robot.string());
  std::vector<std::string> words =
      o.drive.empty() ? DriveFor({arm, LoadCatalogue()}) : std::vector<std::string>{o.drive};
  words.insert(words.end(), {"--scenario", scenario.string(), "--robot", robot.string(), "--storage", o.storage,
                             "--port", std::to_string(o.port)});
  if (!o.truth_log.empty()) words.insert(words.end(), {"--truth-log", o.truth_log});
  if (o.read_port >= 0) words.insert(words.end(), {"--read-port", std::to_string(o.read_port)});
  if (!o.serial.empty()) words.insert(words.end(), {"--serial", o.serial});
  if (!o.key.empty()) words.insert(words.end(), {"--key", o.key});
  if (o.real_time) words.push_back("--real-time");
  if (!o.json.empty()) words.insert(words.end(), {"--json", o.json});
  RemoveEarlier(o.json);
  Become(words);
}

}  // namespace

void AddSimulate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "simulate",
      "run the simulated drive of any robot (Modbus TCP on 127.0.0.1); for a robot that armcal was not built with it "
      "is "
      "compiled once, with g++\nexample: armcal simulate --scenario stribeck --port 1502\nexample: armcal simulate "
      "--robot my_arm.toml --port 1502");
  auto o = std::make_shared<SimulateOptions>();
  verb->add_option("--scenario", o->scenario, "scenario file, or a name in host_sim/scenarios")->capture_default_str();
  verb->add_option("--robot", o->robot, "robot file or name")->capture_default_str();
  verb->add_option("--drive", o->drive, "drive program (default: the one of the robot)");
  verb->add_option("--port", o->port, "TCP port, 0: any free one")->capture_default_str()->check(Between(0, 65535));
  verb->add_option("--read-port", o->read_port, "a second TCP port that serves reading alone, 0: any free one")
      ->check(Between(0, 65535));
  verb->add_option("--serial", o->serial, "also serve Modbus RTU on this terminal: 115200 baud, even parity, unit 1");
  verb->add_option("--storage", o->storage, "file that plays the drive's flash memory")->capture_default_str();
  verb->add_option("--truth-log", o->truth_log,
                   "what the torque sensors would read without noise, for the report's floor");
  verb->add_option("--key", o->key, "file with a key: the drive then takes only tables that are signed with it");
  verb->add_option("--json", o->json, "write address, robot and schema here once the drive listens");
  verb->add_flag("--real-time", o->real_time, "run in real time (default: as fast as this computer can)");
  verb->callback([o, &action] { action = [o] { return RunSimulate(*o); }; });
}

}  // namespace armcal::tool
