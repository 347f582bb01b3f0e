// cli - armcal diagnose --batch: one process a log on all cores, so that a bad log ends alone; knows no search.
#include "host_sim/cli/diagnose_batch.hpp"

#include <fmt/core.h>
#include <map>
#include <mutex>

#include "host_sim/cli/diagnose_summary.hpp"
#include "host_sim/cli/process.hpp"
#include "host_sim/io/files.hpp"
#include "host_sim/io/input_error.hpp"
#include "host_sim/report/progress.hpp"
#include "host_sim/search/parallel.hpp"

namespace armcal::cli {

namespace fs = std::filesystem;

namespace {

const char* const kLayout =
    "NAME.train.csv and NAME.test.csv (or .csv.gz), or folders NAME with train.csv and test.csv";

struct Case {
  std::string name;
  std::string train, test, robot;  // empty: not there
};

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
std::vector<Case> FindCases(const fs::path& folder, const std::string& robot) {
  if (!fs::is_directory(folder)) throw io::InputError(folder.string() + ": expected a folder of logs");
  const fs::path shared = folder / "robot.toml";
  std::map<std::string, Case> found;
  const auto add = [&](const fs::path& file, const std::string& inside) {
    for (const char* role : {"train", "test"}) {
      std::string name;
      if (!Strip(file.filename().string(), role, name)) continue;
      const bool pair = name.size() > 1 && name.back() == '.';
      if (inside.empty() ? !pair : !name.empty()) continue;
      name = inside.empty() ? name.substr(0, name.size() - 1) : inside;
      Case& c = found[name];
      std::string& log = role == std::string("train") ? c.train : c.test;
      if (!log.empty()) throw io::InputError(file.string() + ": expected one " + role + " log of the name " + name);
      log = file.string();
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
  std::vector<Case> cases;
  for (auto& [name, c] : found) {
    c.name = name;
    cases.push_back(std::move(c));
  }
  if (cases.empty()) throw io::InputError(folder.string() + ": expected " + kLayout);
  return cases;
}

// "2/8": every eighth, beginning with the second.
std::vector<Case> Part(const std::vector<Case>& all, const std::string& part) {
  if (part.empty()) return all;
  int which = 0, of = 0, read = 0;
  if (std::sscanf(part.c_str(), "%d/%d%n", &which, &of, &read) != 2 || read != static_cast<int>(part.size()) ||
      which < 1 || which > of)
    throw io::InputError("--part " + part + ": expected K/N with K from 1 to N");
  std::vector<Case> some;
  for (std::size_t k = static_cast<std::size_t>(which) - 1; k < all.size(); k += static_cast<std::size_t>(of))
    some.push_back(all[k]);
  return some;
}

// What a failed run said: its last line, which is the message.
std::string Reason(const fs::path& log, int code) {
  std::string text = io::ReadWholeFile(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::string last = text.substr(text.rfind('\n') + 1), mark = "armcal: ";
  return last.starts_with(mark) ? last.substr(mark.size()) : fmt::format("ended with code {}", code);
}

nlohmann::ordered_json Diagnose(const Case& c, const DiagnoseOptions& one, const fs::path& out) {
  const auto file = [&](const char* end) { return (out / (c.name + end)).string(); };
  for (const char* end : {".json", ".html", ".toml", ".log"}) fs::remove(file(end));
  std::string why = c.train.empty()   ? "no train log"
                    : c.test.empty()  ? "no test log"
                    : c.robot.empty() ? "no robot: expected --robot, or robot.toml beside the logs"
                                      : "";
  if (why.empty()) {
    std::vector<std::string> words{fs::read_symlink("/proc/self/exe").string(),
                                   "diagnose",
                                   "--robot",
                                   c.robot,
                                   "--train",
                                   c.train,
                                   "--test",
                                   c.test,
                                   "--json",
                                   file(".json"),
                                   "--report",
                                   file(".html"),
                                   "--model-out",
                                   file(".toml")};
    if (!one.channels.empty()) words.insert(words.end(), {"--channels", one.channels});
    const int code = RunProgram(words, file(".log"));
    if (code == kOk) return ReadVerdict(file(".json"));
    why = Reason(file(".log"), code);
  }
  WriteJson(file(".json"), FailedVerdict(why));
  return FailedVerdict(why);
}

Verdicts DiagnoseAll(const std::vector<Case>& cases, const DiagnoseOptions& one, const BatchOptions& batch) {
  fs::create_directories(batch.out);
  Verdicts verdicts;
  report::Progress progress(fmt::format("{} logs", cases.size()));
  std::mutex mutex;
  search::InParallel(static_cast<int>(cases.size()), batch.jobs, [&](int k) {
    const Case& c = cases[static_cast<std::size_t>(k)];
    const nlohmann::ordered_json verdict = Diagnose(c, one, batch.out);
    const std::lock_guard lock(mutex);
    verdicts[c.name] = verdict;
    progress.Set(static_cast<double>(verdicts.size()) / static_cast<double>(cases.size()));
  });
  return verdicts;
}

// Verdicts of other jobs; a log of the batch that has none gets a line that says so.
Verdicts Collect(const BatchOptions& batch, const DiagnoseOptions& one) {
  Verdicts verdicts = ReadVerdicts(batch.summary);
  if (!batch.folder.empty())
    for (const Case& c : FindCases(batch.folder, one.robot))
      verdicts.emplace(c.name, FailedVerdict("no verdict: its job has not ended"));
  if (verdicts.empty()) throw io::InputError("--summary: expected files that armcal diagnose --json wrote");
  return verdicts;
}

void Check(const DiagnoseOptions& one, const BatchOptions& batch) {
  if (!one.train.empty() || !one.test.empty() || !one.model_out.empty())
    throw io::InputError("--batch, --summary: expected no --train, --test or --model-out beside them");
  if (!batch.summary.empty()) return;
  if (batch.out.empty()) throw io::InputError("--batch: expected --out FOLDER for the verdicts");
  if (batch.jobs < 0) throw io::InputError("--jobs: expected 1 or more, or 0 for one a core");
}

}  // namespace

void AddBatchOptions(CLI::App& verb, BatchOptions& b) {
  verb.add_option("--batch", b.folder,
                  std::string("diagnose a folder of logs: ") + kLayout +
                      "; the robot is the folder's robot.toml, or --robot, or the batch's robot.toml");
  verb.add_option("--out", b.out, "with --batch: NAME.json, .html, .toml and .log of each log go to this folder");
  verb.add_option("--jobs", b.jobs, "with --batch: logs at a time; 0: one a core");
  verb.add_option("--part", b.part, "with --batch: K/N, every N-th log beginning with the K-th, for independent jobs");
  verb.add_option("--summary", b.summary,
                  "merge verdicts (files, or folders of them) that were written before; with --batch, logs of that "
                  "folder without a verdict are named");
}

int RunBatch(const DiagnoseOptions& one, const BatchOptions& batch) {
  Check(one, batch);
  const Verdicts verdicts = batch.summary.empty()
                                ? DiagnoseAll(Part(FindCases(batch.folder, one.robot), batch.part), one, batch)
                                : Collect(batch, one);
  const nlohmann::ordered_json summary = SummaryJson(verdicts);
  fmt::print("{}", SummaryText(summary));
  WriteJson(one.json, summary);
  if (!one.report.empty()) {
    WriteSummaryPage(one.report, summary);
    fmt::print("report: {}\n", one.report);
  }
  return summary["failed"] == 0 ? kOk : kPartial;
}

}  // namespace armcal::cli
