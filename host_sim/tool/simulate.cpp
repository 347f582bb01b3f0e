// tool - armcal simulate: starts the simulated drive that was compiled for a robot; knows nothing of what happens in
// it.
#include <unistd.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct SimulateOptions {
  std::string scenario, robot = "er20_like", drive, storage = "build/drive.nor", truth_log;
  int port = 1502;
  bool real_time = false;
};

int RunSimulate(const SimulateOptions& o) {
  namespace fs = std::filesystem;
  const fs::path robot = RobotPath(o.robot);
  const fs::path scenario = fs::is_regular_file(o.scenario)
                                ? fs::path(o.scenario)
                                : Home() / "host_sim" / "scenarios" / (o.scenario + ".toml");
  if (!fs::is_regular_file(scenario))
    throw io::InputError("scenario " + o.scenario + ": expected a file, or a name in host_sim/scenarios");
  const std::string name = codegen::ReadRobot(robot).name;
  const fs::path drive =
      o.drive.empty() ? fs::read_symlink("/proc/self/exe").parent_path() / ("armcal-drive-" + name) : fs::path(o.drive);
  if (!fs::is_regular_file(drive))
    throw io::InputError(drive.string() + ": no simulated drive has been built for robot " + name);
  if (const auto folder = fs::path(o.storage).parent_path(); !folder.empty()) fs::create_directories(folder);
  std::vector<std::string> words{drive.string(), "--scenario",   scenario.string(),
                                 "--robot",      robot.string(), "--storage",
                                 o.storage,      "--port",       std::to_string(o.port)};
  if (!o.truth_log.empty()) words.insert(words.end(), {"--truth-log", o.truth_log});
  if (o.real_time) words.push_back("--real-time");
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  throw io::InputError(drive.string() + ": cannot be started");
}

}  // namespace

void AddSimulate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "simulate",
      "run the simulated drive (Modbus TCP on 127.0.0.1)\nexample: armcal simulate --scenario stribeck --port 1502");
  auto o = std::make_shared<SimulateOptions>();
  verb->add_option("--scenario", o->scenario, "scenario file, or a name in host_sim/scenarios")->required();
  verb->add_option("--robot", o->robot, "robot file or name")->capture_default_str();
  verb->add_option("--drive", o->drive, "drive program (default: the one built for the robot)");
  verb->add_option("--port", o->port, "TCP port, 0: any free one")->capture_default_str()->check(CLI::Range(0, 65535));
  verb->add_option("--storage", o->storage, "file that plays the drive's flash memory")->capture_default_str();
  verb->add_option("--truth-log", o->truth_log,
                   "what the torque sensors would read without noise, for the report's floor");
  verb->add_flag("--real-time", o->real_time, "one virtual second a second (default: as fast as the host follows)");
  verb->callback([o, &action] { action = [o] { return RunSimulate(*o); }; });
}

}  // namespace armcal::tool
