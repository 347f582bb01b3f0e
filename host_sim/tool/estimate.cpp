// tool - armcal estimate: starts the estimator program that was compiled for a robot.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct EstimateOptions {
  std::string connect, robot, program, log, table, records, json;
};

int RunEstimate(const EstimateOptions& o) {
  const std::filesystem::path robot = RobotPath(o.robot);
  const std::string name = codegen::ReadRobot(robot).name;
  const std::string program = ProgramFor("armcal-estimate", name, o.program, "estimator");
  if (o.connect.empty() == o.log.empty()) throw io::InputError("estimate: expected either --connect or --log");
  std::vector<std::string> words{program, "--robot", robot.string(), "--effects",
                                 (Home() / "codegen" / "effects").string()};
  if (!o.connect.empty()) {
    if (IsSerialLine(o.connect))
      throw io::InputError("--connect " + o.connect + ": expected HOST:PORT; a serial line cannot carry every sample");
    const auto [host, port] = HostAndPort(o.connect);
    words.insert(words.end(), {"--host", host, "--port", std::to_string(port)});
  }
  for (const auto& [key, value] :
       {std::pair{"--log", o.log}, {"--table", o.table}, {"--records", o.records}, {"--json", o.json}})
    if (!value.empty()) words.insert(words.end(), {key, value});
  Become(words);
}

}  // namespace

void AddEstimate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("estimate",
                                  "run the firmware's estimator here, on the drive's live trace or on a log\nexample: "
                                  "armcal estimate --connect 127.0.0.1:1502 --robot er20_like");
  auto o = std::make_shared<EstimateOptions>();
  verb->add_option("--connect", o->connect,
                   "drive, HOST:PORT: every sample from now on, until it falls silent for two seconds");
  verb->add_option("--log", o->log, "a recorded log instead");
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  verb->add_option("--table", o->table, "with --log: parameter table to start from (default: the robot file's)");
  verb->add_option("--records", o->records, "keep the table, the samples and the drive's estimate as raw words");
  verb->add_option("--program", o->program, "estimator program (default: the one built for the robot)");
  verb->add_option("--json", o->json, "write the estimates here");
  verb->callback([o, &action] { action = [o] { return RunEstimate(*o); }; });
}

}  // namespace armcal::tool
