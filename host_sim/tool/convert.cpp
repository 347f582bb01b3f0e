// tool - armcal convert: writes a log of any format as armcal's own CSV.
#include <fmt/core.h>

#include "host_sim/tool/logs.hpp"

namespace armcal::tool {
namespace {

struct ConvertOptions {
  std::string log, out, json;
  LogFormat format;
};

int Run(const ConvertOptions& o) {
  constexpr int kFewest = 2;
  logs::Log log = logs::ReadLog(o.log, MapOf(o.format), kFewest);
  for (const std::string& note : log.notes) SayAside(o.log + ": " + note);
  log.t.array() -= log.t[0];
  logs::WriteLog(o.out, log, logs::Digits::kAll);
  WriteJson(o.json, {{"file", o.out},
                     {"joints", log.joints},
                     {"samples", log.samples()},
                     {"step_s", log.step_s()},
                     {"gaps", log.gaps.size()},
                     {"notes", log.notes}});
  fmt::print("{}: {} samples of {} joints, {:.4g} Hz, {} gaps\n", o.out, log.samples(), log.joints, 1 / log.step_s(),
             log.gaps.size());
  return kOk;
}

}  // namespace

void AddConvert(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("convert",
                                  "write a log of any format as armcal's own CSV, in SI units; its time begins at 0\n"
                                  "example: armcal convert run.mcap --channels map.toml -o run.csv.gz");
  auto o = std::make_shared<ConvertOptions>();
  verb->add_option("log", o->log, "CSV, MCAP, rosbag2 (.db3 or folder) or MATLAB (.mat)")->required();
  verb->add_option("--channels", o->format.channels, "channel map (TOML) of the log")->required();
  verb->add_option("-o,--out", o->out, "log to write, .csv or .csv.gz")->required();
  AddMessages(*verb, o->format.messages);
  verb->add_option("--json", o->json, "write counts, sample time and notes here");
  verb->callback([o, &action] { action = [o] { return Run(*o); }; });
}

}  // namespace armcal::tool
