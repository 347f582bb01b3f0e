// tool - makes the splits, has them diagnosed, says what they have in common.
#include "host_sim/tool/diagnose_splits.hpp"

#include <fmt/core.h>
#include <set>
#include <sstream>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/verdict/diagnose_splits_report.hpp"
#include "host_sim/tool/diagnose_cases.hpp"

namespace armcal::tool {

namespace fs = std::filesystem;

namespace {

// "runs/a.csv.gz" -> "a".
std::string RunName(const std::string& path) {
  const std::string file = fs::path(path).filename().string();
  return file.substr(0, file.find(".csv"));
}

// Each run with everything outside of its group to train on.
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

}  // namespace

int RunSplits(const DiagnoseOptions& one, const BatchOptions& options) {
  const std::vector<DiagnosisCase> cases = MakeSplits(options.splits, one.robot);
  const verdict::Verdicts verdicts = DiagnoseAll(cases, one, options.out, options.jobs);
  const verdict::Agreed agreed = verdict::Agree(verdicts);
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
    if (v["verdict"] == "failed") return kPartial;
  return kOk;
}

}  // namespace armcal::tool
