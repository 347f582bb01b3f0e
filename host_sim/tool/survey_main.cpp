// tool - the program behind armcal survey: makes the tables and figures of the survey again, with better methods beside
// them. A program of its own, so that whoever builds armcal for an arm need not build it.
//   armcal-survey survey [OPTION...]
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/study/survey/publish.hpp"
#include "host_sim/study/survey/tables.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/survey_verb.hpp"

namespace armcal::tool {
namespace {

// Folder of measured logs: the option, or the one below ARMCAL_DATA; empty where there is none.
std::string MeasuredLogs(const SurveyOptions& o) {
  const char* data = std::getenv("ARMCAL_DATA");
  const std::string folder = !o.data.empty() ? o.data : data ? std::string(data) + "/measured" : "";
  if (!folder.empty() && std::filesystem::is_directory(folder)) return folder;
  if (!o.data.empty()) throw io::InputError("--data " + o.data + ": expected a folder of measured logs");
  return "";
}

int RunSurvey(const SurveyOptions& o) {
  survey::Settings s;
  s.home = Home().string();
  s.robot = codegen::ReadRobot(RobotPath(o.robot));
  s.records = LoadCatalogue();
  s.levels = survey::ReadLevels(s.home + "/host_sim/study/survey/levels.toml");
  s.printed = survey::ReadPrinted(s.home + "/host_sim/study/survey/printed.toml");
  if (s.levels.tau_max_Nm.size() != s.robot.joint.size() || !s.robot.has_prior)
    throw io::InputError(s.robot.path + ": expected an arm with CAD values and " +
                         std::to_string(s.levels.tau_max_Nm.size()) + " joints, like the survey's");
  s.measured = MeasuredLogs(o);
  s.tables = o.tables, s.draws = o.draws, s.slow_draws = o.slow_draws, s.seed = o.seed, s.search_s = o.search_s,
  s.searches = o.searches;
  s.cad_feedforward = o.feedforward == "cad";
  s.stop = &InterruptGuard::interrupted();
  std::string task;
  std::unique_ptr<report::Progress> line;
  s.progress = [&](const std::string& what, double share) {
    if (what != task) line.reset(), line = std::make_unique<report::Progress>(what), task = what;
    line->Set(share);
  };
  const InterruptGuard guard;  // what is there by then is shown
  const survey::Findings found = survey::RunSurvey(s);
  line.reset();
  for (const survey::Sheet& sheet : found.sheets) {
    fmt::print("\nTable {}\n{}", sheet.number, report::Text(survey::TableOf(sheet)));
    for (const std::string& note : sheet.notes) fmt::print("  {}\n", note);
  }
  if (s.measured.empty() && s.Wants("12")) fmt::print("Table 12 on measured logs: left out, ARMCAL_DATA is not set\n");
  fmt::print("\n{}", survey::GoalLines(found));
  if (!o.json.empty()) files::WriteWholeFile(o.json, survey::Json(found, s));
  if (!o.report.empty()) files::WriteWholeFile(o.report, survey::Html(found, s));
  if (InterruptGuard::interrupted()) return kPartial;
  return std::all_of(found.goals.begin(), found.goals.end(), [](const survey::Goal& g) { return g.met(); }) ? kOk
                                                                                                            : kMismatch;
}

}  // namespace
}  // namespace armcal::tool

int main(int argc, char** argv) {
  using namespace armcal::tool;
  CLI::App app;
  Action action;
  AddSurveyVerb(app, action, [](const SurveyOptions& o, const CLI::App&) { return RunSurvey(o); });
  try {
    app.parse(argc, argv);
    return action();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "armcal: %s\n", e.what());
    return kBadInput;
  }
}
