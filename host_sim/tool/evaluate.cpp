// tool - armcal evaluate: the torque error of a given model on logs; nothing is fitted.
#include <fmt/core.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/analysis/evaluated.hpp"
#include "host_sim/tool/given.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"
#include "host_sim/tool/watched.hpp"

namespace armcal::tool {
namespace {

struct EvaluateOptions {
  GivenOptions given;
  std::vector<std::string> logs;
  std::string json;
  LogFormat format;
  double band_Hz = 0, cutoff_Hz = 0;
};

int RunEvaluate(const EvaluateOptions& o) {
  const codegen::Model model = GivenModel(o.given);
  const calibration::Given given = ReadGiven(o.given, model);
  const LogReader read(model, o.format, o.cutoff_Hz);
  Watched line("evaluate");
  const auto say = [&line](const std::string& text) { line.Clear(), SayAside(text); };
  const std::vector<calibration::Dataset> logs = read.All(o.logs, say);
  io::SetDone(0.5);
  const analysis::Evaluated result = analysis::Evaluate(model, given, logs, o.band_Hz);
  line.Clear();
  for (std::size_t k = 0; k < logs.size(); ++k) verdict::PrintError(result.each[k], model.robot(), logs[k].source);
  if (result.together)
    verdict::PrintError(*result.together, model.robot(), fmt::format("all {} logs as one record", logs.size()));
  nlohmann::ordered_json json = ToJson(o.given, model);
  json.update(result.json);
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddEvaluate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "evaluate",
      "the torque error of a given model on logs; nothing is fitted\nexample: armcal evaluate --robot er20_like "
      "--table table.toml test.csv.gz --band 20\nexample: armcal evaluate --model new.toml test.csv.gz");
  auto o = std::make_shared<EvaluateOptions>();
  AddGivenOptions(*verb, o->given);
  verb->add_option("logs", o->logs, "log(s) to predict")->required();
  AddLogFormat(*verb, o->format);
  AddBand(*verb, o->band_Hz);
  AddCutoff(*verb, o->cutoff_Hz);
  verb->add_option("--json", o->json, "write everything here");
  verb->callback([o, &action] { action = [o] { return RunEvaluate(*o); }; });
}

}  // namespace armcal::tool
