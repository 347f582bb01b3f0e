// tool - armcal diagnose: finds in the training logs what the model lacks, and judges it on the test log.
#include <fmt/core.h>
#include <algorithm>
#include <cstdio>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/verdict/diagnosis_page.hpp"
#include "host_sim/diagnose/verdict/words.hpp"
#include "host_sim/identify/calibration/table_ceilings.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/diagnose.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"
#include "host_sim/tool/watched.hpp"

namespace armcal::tool {

namespace {

void Print(const analysis::Diagnosed& run, const DiagnoseOptions& o) {
  const nlohmann::ordered_json& json = run.json;
  fmt::print("{}", verdict::DiagnosisText(run.view));
  report::Table table{{"joint", "unit", "before", "after", "before, moving", "after, moving", "noise floor",
                       "smallest detectable effect"},
                      {}};
  for (int j = 0; j < run.model->joints(); ++j) {
    std::vector<std::string> row{std::to_string(j + 1), json["torque_units"][j]};
    for (const char* key : {"before", "after", "before_moving", "after_moving", "noise_floor", "smallest_detectable"})
      row.push_back(json[key][j].is_null() ? "-" : fmt::format("{:.4g}", json[key][j].get<double>()));
    table.rows.push_back(row);
  }
  fmt::print(
      "held out: {}, RMS of measured minus predicted torque of all samples; moving: without those at rest and beside a "
      "jolt\n{}",
      o.test, report::Text(table));
  if (!o.model_out.empty() && !run.view.finding->terms.empty()) {
    const bool held = std::any_of(json["terms"].begin(), json["terms"].end(),
                                  [](const auto& t) { return t["in_model"].template get<bool>(); });
    const bool confirmed = verdict::AnyConfirmed(*run.view.finding);
    fmt::print(
        "new model: {} ({})\n", o.model_out,
        !confirmed ? "the declared one: no term is confirmed"
        : !held    ? "with what was found as comments: no model can hold it"
        : json["model"]["by_table"].get<bool>()
            ? "a table switches it on"
            : fmt::format("fit it: armcal identify --robot {0} --table-out TABLE; for a drive build its firmware "
                          "from {0}, then flash TABLE",
                          o.model_out));
  }
}

}  // namespace

std::unique_ptr<analysis::Diagnosed> RunDiagnosis(const DiagnoseOptions& o) {
  codegen::Catalogue catalogue = LoadCatalogue();
  auto declared = std::make_unique<codegen::Model>(codegen::ReadRobot(RobotPath(o.robot)), catalogue);
  const codegen::Model& model = *declared;
  for (const std::string& p : o.train)
    if (std::error_code none; std::filesystem::equivalent(p, o.test, none))
      throw io::InputError("--test " + o.test + ": expected another log than those of --train");
  const LogReader read(model, o.format);
  const std::vector<logs::Log> train = read.Raw(o.train);
  Watched line("diagnose");
  const auto say = [&line](const std::string& text) { line.Clear(), SayAside(text); };
  auto run = std::make_unique<analysis::Diagnosed>(std::move(declared), std::move(catalogue), train, o.how, say);
  line.Clear();
  read.PrintUntold(run->train);
  const diagnosis::Finding& finding = run->diagnosis->finding();

  // The model is written, and its hash taken, before the held-out log is opened.
  std::string provenance = "Train:", model_hash;
  for (const std::string& p : calibration::Sources(run->train))
    provenance +=
        " " + std::filesystem::path(p).filename().string() + " (sha256 " + files::FileHash(p).substr(0, 16) + ")";
  const auto folder =
      o.model_out.empty() ? std::filesystem::path() : std::filesystem::absolute(o.model_out).parent_path();
  const std::string before_test = diagnosis::ModelFile(model, run->catalogue, finding, provenance, folder).text;
  if (!o.model_out.empty()) {
    files::WriteWholeFile(o.model_out, before_test);
    model_hash = files::FileHash(o.model_out);
  }
  run->Judge(read.Raw(o.test), o.robot, o.json, say);
  line.Clear();
  const diagnosis::NewModel after_test = diagnosis::ModelFile(model, run->catalogue, finding, provenance, folder);
  if (!o.model_out.empty() && after_test.text != before_test)
    files::WriteWholeFile(o.model_out, after_test.text);  // what was not confirmed is taken out
  nlohmann::ordered_json& json = run->json;
  json["provenance"] = provenance, json["test"] = o.test;
  if (!o.model_out.empty()) {
    // The same schema: a table can switch the terms on. Another one: the model must be generated and the drive built.
    const codegen::Model next(codegen::ReadRobot(o.model_out), run->catalogue);
    json["model"] = {{"file", o.model_out},
                     {"sha256_before_test", model_hash},
                     {"schema", codegen::Schema(next)},
                     {"by_table", codegen::Schema(next) == codegen::Schema(model)}};
    if (const std::string beyond = calibration::BeyondCeiling(next, calibration::DefaultTable(next)); !beyond.empty())
      fmt::print(stderr, "armcal: {}: a drive would refuse this model's own table: {}\n", o.model_out, beyond);
  }
  Print(*run, o);
  for (const int j : after_test.from_zero)
    if (!o.model_out.empty())
      fmt::print(
          "joint {}: the friction that was found would push beyond the logs; in {} it starts from zero, and armcal "
          "identify fits it within what a drive takes\n",
          j + 1, o.model_out);
  if (!o.report.empty()) {
    verdict::WriteDiagnosisPage(o.report, json);
    fmt::print("report: {}\n", o.report);
  }
  std::fflush(stdout);
  WriteJson(o.json, json);
  return run;
}

namespace {

int RunOneDiagnosis(const DiagnoseOptions& o) {
  if (o.robot.empty() || o.train.empty() || o.test.empty())
    throw io::InputError("expected --robot, --train and --test, or --batch, or --splits, or --summary");
  TryFleet(o.fleet);
  const auto run = RunDiagnosis(o);
  KeepVerdicts(o.fleet, {{o.fleet.arm.empty() ? run->model->robot().name : o.fleet.arm, run->json}});
  return kOk;
}

}  // namespace

void AddDiagnose(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "diagnose",
      "find what the model lacks: residual, cause, new model, error before and after\nexample: armcal diagnose --robot "
      "er20_like --train train.csv.gz --test test.csv.gz --json out.json --report out.html --model-out new.toml\n"
      "example, many logs: armcal diagnose --batch logs --robot er20_like --out verdicts --json all.json --report "
      "all.html\nexample, which terms hold whatever run is held out: armcal diagnose --robot kuka_lwr4 --splits "
      "run1.csv,run2.csv run3.csv --out splits");
  auto o = std::make_shared<DiagnoseOptions>();
  verb->add_option("--robot", o->robot, "robot file or name");
  verb->add_option("--train", o->train, "log(s) on which everything is decided");
  verb->add_option("--test", o->test, "held-out log: read once, after the model is written");
  AddLogFormat(*verb, o->format);
  AddFleetOptions(*verb, o->fleet, "verdicts", "when the held-out log was made (default: the file's time)",
                  " (default: the robot's)");
  AddCutoff(*verb, o->how.cutoff_Hz);
  auto* never = verb->add_flag_callback(
      "--no-turns", [o] { o->how.at_turns = diagnosis::AtTurns::kNever; }, "leave out rows near turns and at rest");
  verb->add_flag_callback(
          "--turns", [o] { o->how.at_turns = diagnosis::AtTurns::kAlways; },
          "look at rows near turns and at rest, where friction builds up or sticks; default: where the torque shows "
          "only slow motion")
      ->excludes(never);
  verb->add_option("--gain-tolerance", o->how.gain_tolerance,
                   "share by which each joint's torque may be off: for the mass of a payload that the held-out log "
                   "carries; default: the robot file's, or 0.1")
      ->check(Between(1e-6, 0.9));
  verb->add_option("--json", o->json, "write the verdict here");
  verb->add_option("--report", o->report, "write a self-contained page here");
  verb->add_option("--model-out", o->model_out, "write the robot file with the terms here");
  auto batch = std::make_shared<BatchOptions>();
  AddBatchOptions(*verb, *batch);
  verb->callback([o, batch, &action] {
    action = [o, batch] {
      if (batch->asked()) return RunBatch(*o, *batch);
      if (!batch->out.empty() || batch->jobs != 0 || !batch->part.empty())
        throw io::InputError("--out, --jobs, --part: expected --batch or --splits beside them");
      return RunOneDiagnosis(*o);
    };
  });
}

}  // namespace armcal::tool
