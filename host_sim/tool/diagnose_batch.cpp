// tool - armcal diagnose --batch and --splits: runs many diagnoses, one process each, and sums up what they found.
#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/diagnose/verdict/splits.hpp"
#include "host_sim/diagnose/verdict/summary.hpp"
#include "host_sim/identify/search/parallel.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/diagnose.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

namespace fs = std::filesystem;

namespace {

// An empty field means that the file is missing. The verdict then says so.
struct DiagnosisCase {
  std::string name;
  std::vector<std::string> train, test;  // test: one
  std::string robot;
};

// What a failed run said: its last line, which is the message.
std::string Reason(const fs::path& log, int code) {
  std::string text = files::ReadWholeFile(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::string last = text.substr(text.rfind('\n') + 1), mark = "armcal: ";
  return last.starts_with(mark) ? last.substr(mark.size()) : fmt::format("ended with code {}", code);
}

nlohmann::ordered_json Diagnose(const DiagnosisCase& c, const DiagnoseOptions& one, const BatchOptions& batch) {
  const auto file = [&](const char* end) { return (fs::path(batch.out) / (c.name + end)).string(); };
  if (batch.resume && fs::is_regular_file(file(".json")))
    if (const auto kept = verdict::ReadVerdict(file(".json")); !verdict::Failed(kept)) return kept;
  for (const char* end : {".json", ".html", ".toml", ".log"}) fs::remove(file(end));
  std::string why = c.train.empty()   ? "no train log"
                    : c.test.empty()  ? "no test log"
                    : c.robot.empty() ? "no robot: expected --robot, or robot.toml beside the logs"
                                      : "";
  if (why.empty()) {
    std::vector<std::string> words{OwnProgram(), "diagnose", "--robot", c.robot};
    const auto add = [&](const char* option, const std::vector<std::string>& values) {
      words.push_back(option);
      words.insert(words.end(), values.begin(), values.end());
    };
    add("--train", c.train), add("--test", c.test);
    add("--json", {file(".json")}), add("--report", {file(".html")}), add("--model-out", {file(".toml")});
    if (!one.format.channels.empty()) add("--channels", {one.format.channels});
    for (const std::string& message : one.format.messages) add("--msg", {message});
    if (one.how.at_turns == diagnosis::AtTurns::kAlways) add("--turns", {});
    if (one.how.at_turns == diagnosis::AtTurns::kNever) add("--no-turns", {});
    if (one.how.cutoff_Hz > 0) add("--cutoff", {fmt::format("{}", one.how.cutoff_Hz)});
    if (one.how.gain_tolerance > 0) add("--gain-tolerance", {fmt::format("{}", one.how.gain_tolerance)});
    const int code = RunProgram(words, file(".log"));
    if (code == kOk) return verdict::ReadVerdict(file(".json"));
    why = Reason(file(".log"), code);
  }
  WriteJson(file(".json"), verdict::FailedVerdict(why));
  return verdict::FailedVerdict(why);
}

// NAME.json, .html, .toml and .log of each case go to the batch's folder. one: how each log is read.
verdict::Verdicts DiagnoseAll(const std::vector<DiagnosisCase>& cases, const DiagnoseOptions& one,
                              const BatchOptions& batch) {
  io::MakeFolder(batch.out);
  verdict::Verdicts verdicts;
  report::Progress progress(fmt::format("{} logs", cases.size()));
  std::mutex mutex;
  search::InParallel(static_cast<int>(cases.size()), batch.jobs, [&](int k) {
    const DiagnosisCase& c = cases[static_cast<std::size_t>(k)];
    const nlohmann::ordered_json verdict = Diagnose(c, one, batch);
    const std::lock_guard lock(mutex);
    verdicts[c.name] = verdict;
    if (!c.test.empty()) KeepVerdicts(one.fleet, {{c.name, verdict}}, {{c.name, c.test[0]}});
    progress.Set(static_cast<double>(verdicts.size()) / static_cast<double>(cases.size()));
  });
  return verdicts;
}

const char* const kLayout =
    "NAME.train.csv and NAME.test.csv, or folders NAME with train.csv and test.csv (or .csv.gz, .mcap, .db3, .mat, a "
    "folder of rosbag2)";
const std::vector<std::string> kLogEnds = {".csv", ".csv.gz", ".mcap", ".mcap.zst", ".db3", ".db3.zst", ".mat"};

// "arm7.train.csv.gz" of role "train" -> "arm7."; "train.csv" -> "". A folder has no end. False for another role.
bool Strip(const fs::path& path, const std::string& role, std::string& name) {
  const std::string file = path.filename().string();
  const std::vector<std::string> folder{""};
  for (const std::string& end : fs::is_directory(path) ? folder : kLogEnds)
    if (file.ends_with(role + end)) {
      name = file.substr(0, file.size() - role.size() - end.size());
      return true;
    }
  return false;
}

// The cases of a folder by name, with the files that each of them has.
std::vector<DiagnosisCase> FindCases(const fs::path& folder, const std::string& robot) {
  if (!fs::is_directory(folder)) throw io::InputError(folder.string() + ": expected a folder of logs");
  const fs::path shared = folder / "robot.toml";
  std::map<std::string, DiagnosisCase> found;
  const auto add = [&](const fs::path& file, const std::string& inside) {
    for (const char* role : {"train", "test"}) {
      std::string name;
      if (!Strip(file, role, name)) continue;
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
    const std::string name = e.path().filename().string();
    if (!e.is_directory() || name.ends_with(".train") || name.ends_with(".test")) {
      add(e.path(), "");
      continue;
    }
    for (const auto& inner : fs::directory_iterator(e.path())) add(inner.path(), name);
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

// The verdicts of other jobs. A log of the batch without a verdict gets a line that says so.
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
  if (!one.fleet.arm.empty())
    throw io::InputError("--arm: expected --train and --test; in a batch the logs name the arms");
  if (!batch.splits.empty() && !one.fleet.database.empty())
    throw io::InputError("--splits: expected no --db beside it; each run is a part of one result");
  if (!batch.splits.empty() && !(batch.folder.empty() && batch.summary.empty() && batch.part.empty()))
    throw io::InputError("--splits: expected no --batch, --summary or --part beside it");
  if (!batch.summary.empty()) return;
  if (batch.out.empty()) throw io::InputError("--batch, --splits: expected --out FOLDER for the verdicts");
  if (batch.jobs < 0) throw io::InputError("--jobs: expected 1 or more, or 0 for one a core");
}

// "runs/a.csv.gz" -> "a".
std::string RunName(const std::string& path) {
  const std::string file = fs::path(path).filename().string();
  for (const std::string& end : kLogEnds)
    if (file.ends_with(end)) return file.substr(0, file.size() - end.size());
  return file;
}

// Holds out each run once. All runs outside of its group are its training logs.
std::vector<DiagnosisCase> MakeSplits(const std::vector<std::string>& groups, const std::string& robot) {
  std::vector<std::vector<std::string>> runs;
  std::set<std::string> names;
  for (const std::string& group : groups) {
    runs.emplace_back();
    std::istringstream in(group);
    for (std::string run; std::getline(in, run, ',');) {
      if (!names.insert(RunName(run)).second) throw io::InputError(run + ": expected one run of this name");
      runs.back().push_back(run);
    }
  }
  if (runs.size() < 2) throw io::InputError("--splits: expected two groups of runs or more");
  std::vector<DiagnosisCase> cases;
  for (std::size_t out = 0; out < runs.size(); ++out)
    for (const std::string& held_out : runs[out]) {
      DiagnosisCase c{RunName(held_out), {}, {held_out}, robot};
      for (std::size_t g = 0; g < runs.size(); ++g)
        if (g != out) c.train.insert(c.train.end(), runs[g].begin(), runs[g].end());
      cases.push_back(c);
    }
  return cases;
}

// The terms of all splits on the runs of all splits. A run without a verdict is left out: its log may not be readable.
verdict::Comparison CompareSplits(const DiagnoseOptions& one, const std::vector<DiagnosisCase>& cases,
                                  const verdict::Verdicts& verdicts) {
  verdict::Comparison out;
  if (std::all_of(verdicts.begin(), verdicts.end(), [](const auto& v) { return verdict::Failed(v.second); }))
    return out;
  const codegen::Catalogue catalogue = LoadCatalogue();
  const codegen::Model model(codegen::ReadRobot(RobotPath(one.robot)), catalogue);
  const LogReader read(model, one.format, one.how.cutoff_Hz);
  std::vector<calibration::Dataset> runs;
  std::map<std::vector<std::string>, int> group;  // by training runs
  for (const DiagnosisCase& c : cases) {
    if (verdict::Failed(verdicts.at(c.name))) continue;
    runs.push_back(read.One(c.test[0]));
    out.group[c.name] = group.try_emplace(c.train, static_cast<int>(group.size())).first->second;
  }
  out.traces = verdict::TracesOf(verdicts, verdict::CommonRows(model, runs), catalogue);
  return out;
}

// kOk, or kPartial where a split has no verdict. Throws io::InputError: fewer than two groups of runs, or two runs of
// one name.
int RunSplits(const DiagnoseOptions& one, const BatchOptions& options) {
  const std::vector<DiagnosisCase> cases = MakeSplits(options.splits, one.robot);
  const verdict::Verdicts verdicts = DiagnoseAll(cases, one, options);
  const verdict::Agreed agreed = verdict::Agree(verdicts, CompareSplits(one, cases, verdicts));
  fmt::print("{}", verdict::SplitsText(verdicts, agreed));
  nlohmann::ordered_json json = verdict::SplitsJson(verdicts, agreed);
  for (const DiagnosisCase& c : cases)
    for (const std::string& run : c.train) json["splits"][c.name]["train"].push_back(RunName(run));
  WriteJson(one.json, json);
  verdict::WritePictures(options.out, verdicts, agreed);
  if (!one.report.empty()) {
    verdict::WriteSplitsPage(one.report, one.robot, verdicts, agreed);
    fmt::print("report: {}\n", one.report);
  }
  for (const auto& [name, v] : verdicts)
    if (verdict::Failed(v)) return kPartial;
  return kOk;
}

}  // namespace

void AddBatchOptions(CLI::App& verb, BatchOptions& b) {
  auto* folder = verb.add_option("--batch", b.folder,
                                 std::string("diagnose a folder of logs: ") + kLayout +
                                     "; the robot is the folder's robot.toml, or --robot, or the batch's robot.toml");
  verb.add_option("--out", b.out,
                  "with --batch, --splits: NAME.json, .html, .toml and .log of each log go to this folder")
      ->type_name(kFolder);
  verb.add_option("--jobs", b.jobs, "with --batch, --splits: logs at a time; 0: one a core");
  verb.add_option("--part", b.part, "with --batch: K/N, every N-th log beginning with the K-th, for independent jobs");
  verb.add_flag("--resume", b.resume,
                "with --batch: a log whose verdict is in --out keeps it, so a job that was killed goes on where it "
                "stopped; a log that failed is diagnosed again")
      ->needs(folder);
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
  TryFleet(one.fleet);
  if (!batch.splits.empty()) return RunSplits(one, batch);
  const verdict::Verdicts verdicts = batch.summary.empty()
                                         ? DiagnoseAll(Part(FindCases(batch.folder, one.robot), batch.part), one, batch)
                                         : Collect(batch, one);
  if (!batch.summary.empty()) KeepVerdicts(one.fleet, verdict::ReadVerdicts(batch.summary));  // without missing ones
  const nlohmann::ordered_json summary = verdict::SummaryJson(verdicts);
  fmt::print("{}", verdict::SummaryText(summary));
  WriteJson(one.json, summary);
  if (!one.report.empty()) {
    const bool folder = !batch.summary.empty() && std::filesystem::is_directory(batch.summary[0]);
    verdict::WriteSummaryPage(one.report, summary, folder ? batch.summary[0] : batch.out);
    fmt::print("report: {}\n", one.report);
  }
  return summary["failed"] == 0 ? kOk : kPartial;
}

}  // namespace armcal::tool
