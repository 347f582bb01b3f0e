// tool - starts armcal diagnose for each case and reads what it wrote.
#include "host_sim/tool/diagnose_cases.hpp"

#include <fmt/core.h>
#include <mutex>

#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/identify/search/parallel.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

namespace fs = std::filesystem;

namespace {

// What a failed run said: its last line, which is the message.
std::string Reason(const fs::path& log, int code) {
  std::string text = files::ReadWholeFile(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::string last = text.substr(text.rfind('\n') + 1), mark = "armcal: ";
  return last.starts_with(mark) ? last.substr(mark.size()) : fmt::format("ended with code {}", code);
}

nlohmann::ordered_json Diagnose(const DiagnosisCase& c, const DiagnoseOptions& one, const fs::path& out) {
  const auto file = [&](const char* end) { return (out / (c.name + end)).string(); };
  for (const char* end : {".json", ".html", ".toml", ".log"}) fs::remove(file(end));
  std::string why = c.train.empty()   ? "no train log"
                    : c.test.empty()  ? "no test log"
                    : c.robot.empty() ? "no robot: expected --robot, or robot.toml beside the logs"
                                      : "";
  if (why.empty()) {
    std::vector<std::string> words{fs::read_symlink("/proc/self/exe").string(), "diagnose", "--robot", c.robot};
    const auto add = [&](const char* option, const std::vector<std::string>& values) {
      words.push_back(option);
      words.insert(words.end(), values.begin(), values.end());
    };
    add("--train", c.train), add("--test", c.test);
    add("--json", {file(".json")}), add("--report", {file(".html")}), add("--model-out", {file(".toml")});
    if (!one.channels.empty()) add("--channels", {one.channels});
    if (one.cutoff_Hz > 0) add("--cutoff", {fmt::format("{}", one.cutoff_Hz)});
    const int code = RunProgram(words, file(".log"));
    if (code == kOk) return verdict::ReadVerdict(file(".json"));
    why = Reason(file(".log"), code);
  }
  WriteJson(file(".json"), verdict::FailedVerdict(why));
  return verdict::FailedVerdict(why);
}

}  // namespace

verdict::Verdicts DiagnoseAll(const std::vector<DiagnosisCase>& cases, const DiagnoseOptions& one, const fs::path& out,
                              int jobs) {
  fs::create_directories(out);
  verdict::Verdicts verdicts;
  report::Progress progress(fmt::format("{} logs", cases.size()));
  std::mutex mutex;
  search::InParallel(static_cast<int>(cases.size()), jobs, [&](int k) {
    const DiagnosisCase& c = cases[static_cast<std::size_t>(k)];
    const nlohmann::ordered_json verdict = Diagnose(c, one, out);
    const std::lock_guard lock(mutex);
    verdicts[c.name] = verdict;
    progress.Set(static_cast<double>(verdicts.size()) / static_cast<double>(cases.size()));
  });
  return verdicts;
}

}  // namespace armcal::tool
