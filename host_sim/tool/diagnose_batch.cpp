// tool - armcal diagnose --batch: which logs of a folder belong together, and what they came to.
#include "host_sim/tool/diagnose_batch.hpp"

#include <fmt/core.h>
#include <map>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/verdict/diagnose_summary.hpp"
#include "host_sim/tool/diagnose_cases.hpp"
#include "host_sim/tool/diagnose_splits.hpp"

namespace armcal::tool {

namespace fs = std::filesystem;

namespace {

const char* const kLayout =
    "NAME.train.csv and NAME.test.csv (or .csv.gz), or folders NAME with train.csv and test.csv";

// "arm7.train.csv.gz" of role "train" -> "arm7."; "train.csv" -> "". False for another role.
bool Strip(const std::string& file, const std::string& role, std::string& name) {
  for (const std::string& end : {role + ".csv", role + ".csv.gz"})
    if (file.ends_with(end)) {
      name = file.substr(0, file.size() - end.size());
      return true;
    }
  return false;
}

// By name, with what of each is there.
std::vector<DiagnosisCase> FindCases(const fs::path& folder, const std::string& robot) {
  if (!fs::is_directory(folder)) throw io::InputError(folder.string() + ": expected a folder of logs");
  const fs::path shared = folder / "robot.toml";
  std::map<std::string, DiagnosisCase> found;
  const auto add = [&](const fs::path& file, const std::string& inside) {
    for (const char* role : {"train", "test"}) {
      std::string name;
      if (!Strip(file.filename().string(), role, name)) continue;
      const bool pair = name.size() > 1 && name.back() == '.';
      if (inside.empty() ? !pair : !name.empty()) continue;
      name = inside.empty() ? name.substr(0, name.size() - 1) : inside;
      DiagnosisCase& c = found[name];
      std::vector<std::string>& log = role == std::string("train") ? c.train : c.test;
      if (!log.empty()) throw io::InputError(file.string() + ": expected one " + role + " log of the name " + name);
      log = {file.string()};
      const fs::path own = file.parent_path() / "robot.toml";
      c.robot = !inside.empty() && fs::exists(own) ? own.string()
                : !robot.empty()                   ? robot
                : fs::exists(shared)               ? shared.string()
                                                   : "";
    }
  };
  for (const auto& e : fs::directory_iterator(folder)) {
    if (!e.is_directory()) {
      add(e.path(), "");
      continue;
    }
    for (const auto& inner : fs::directory_iterator(e.path())) add(inner.path(), e.path().filename().string());
  }
  std::vector<DiagnosisCase> cases;
  for (auto& [name, c] : found) {
    c.name = name;
    cases.push_back(std::move(c));
  }
  if (cases.empty()) throw io::InputError(folder.string() + ": expected " + kLayout);
  return cases;
}

// "2/8": every eighth, beginning with the second.
std::vector<DiagnosisCase> Part(const std::vector<DiagnosisCase>& all, const std::string& part) {
  if (part.empty()) return all;
  int which = 0, of = 0, read = 0;
  if (std::sscanf(part.c_str(), "%d/%d%n", &which, &of, &read) != 2 || read != static_cast<int>(part.size()) ||
      which < 1 || which > of)
    throw io::InputError("--part " + part + ": expected K/N with K from 1 to N");
  std::vector<DiagnosisCase> some;
  for (std::size_t k = static_cast<std::size_t>(which) - 1; k < all.size(); k += static_cast<std::size_t>(of))
    some.push_back(all[k]);
  return some;
}

// verdict::Verdicts of other jobs; a log of the batch that has none gets a line that says so.
verdict::Verdicts Collect(const BatchOptions& batch, const DiagnoseOptions& one) {
  verdict::Verdicts verdicts = verdict::ReadVerdicts(batch.summary);
  if (!batch.folder.empty())
    for (const DiagnosisCase& c : FindCases(batch.folder, one.robot))
      verdicts.emplace(c.name, verdict::FailedVerdict("no verdict: its job has not ended"));
  if (verdicts.empty()) throw io::InputError("--summary: expected files that armcal diagnose --json wrote");
  return verdicts;
}

void Check(const DiagnoseOptions& one, const BatchOptions& batch) {
  if (!one.train.empty() || !one.test.empty() || !one.model_out.empty())
    throw io::InputError("--batch, --summary, --splits: expected no --train, --test or --model-out beside them");
  if (!batch.splits.empty() && !(batch.folder.empty() && batch.summary.empty() && batch.part.empty()))
    throw io::InputError("--splits: expected no --batch, --summary or --part beside it");
  if (!batch.summary.empty()) return;
  if (batch.out.empty()) throw io::InputError("--batch, --splits: expected --out FOLDER for the verdicts");
  if (batch.jobs < 0) throw io::InputError("--jobs: expected 1 or more, or 0 for one a core");
}

}  // namespace

void AddBatchOptions(CLI::App& verb, BatchOptions& b) {
  verb.add_option("--batch", b.folder,
                  std::string("diagnose a folder of logs: ") + kLayout +
                      "; the robot is the folder's robot.toml, or --robot, or the batch's robot.toml");
  verb.add_option("--out", b.out,
                  "with --batch, --splits: NAME.json, .html, .toml and .log of each log go to this folder");
  verb.add_option("--jobs", b.jobs, "with --batch, --splits: logs at a time; 0: one a core");
  verb.add_option("--part", b.part, "with --batch: K/N, every N-th log beginning with the K-th, for independent jobs");
  verb.add_option("--summary", b.summary,
                  "merge verdicts (files, or folders of them) that were written before; with --batch, logs of that "
                  "folder without a verdict are named");
  verb.add_option(
      "--splits", b.splits,
      "runs of one arm, each held out once and trained on the others: which terms hold on every split; runs "
      "of one trajectory are joined by commas and never stand on both sides; pictures go to --out, too");
}

int RunBatch(const DiagnoseOptions& one, const BatchOptions& batch) {
  Check(one, batch);
  if (!batch.splits.empty()) return RunSplits(one, batch);
  const verdict::Verdicts verdicts =
      batch.summary.empty()
          ? DiagnoseAll(Part(FindCases(batch.folder, one.robot), batch.part), one, batch.out, batch.jobs)
          : Collect(batch, one);
  const nlohmann::ordered_json summary = verdict::SummaryJson(verdicts);
  fmt::print("{}", verdict::SummaryText(summary));
  WriteJson(one.json, summary);
  if (!one.report.empty()) {
    verdict::WriteSummaryPage(one.report, summary);
    fmt::print("report: {}\n", one.report);
  }
  return summary["failed"] == 0 ? kOk : kPartial;
}

}  // namespace armcal::tool
