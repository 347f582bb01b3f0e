// tool - armcal simulate: starts the simulated drive that was compiled for a robot.
#include "host_sim/tool/process.hpp"
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
  const fs::path scenario = ScenarioPath(o.scenario);
  const std::string name = codegen::ReadRobot(robot).name;
  const std::string drive = ProgramFor("armcal-drive", name, o.drive, "simulated drive");
  if (const auto folder = fs::path(o.storage).parent_path(); !folder.empty()) fs::create_directories(folder);
  std::vector<std::string> words{drive,     "--scenario", scenario.string(),     "--robot", robot.string(), "--storage",
                                 o.storage, "--port",     std::to_string(o.port)};
  if (!o.truth_log.empty()) words.insert(words.end(), {"--truth-log", o.truth_log});
  if (o.real_time) words.push_back("--real-time");
  Become(words);
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
