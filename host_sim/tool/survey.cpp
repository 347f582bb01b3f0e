// tool - armcal survey: makes the tables and figures of the survey again, with better methods beside them.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/study/survey/publish.hpp"
#include "host_sim/study/survey/tables.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct SurveyOptions {
  std::string robot = "er20_like", json, report, data;
  std::vector<std::string> tables;
  std::string feedforward = "set";
  int draws = 200, slow_draws = 5;
  std::uint64_t seed = 1;
  double search_s = 55;
  int searches = 0;
};

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

void AddSurvey(CLI::App& app, Action& action) {
  auto* verb =
      app.add_subcommand("survey",
                         "reproduce the survey's Tables 5 to 12 and Figures 1 to 4, printed figures and better "
                         "methods beside\nexample: armcal survey --table 8 --draws 20 --report survey.html");
  auto o = std::make_shared<SurveyOptions>();
  verb->add_option("--table", o->tables,
                   "5 to 12, trajectories, priors, shipped, widths, laws, choice, bounds, online, figures (default: "
                   "all but widths)")
      ->check(OneOf({"5", "6", "7", "8", "9", "10", "11", "12", "trajectories", "priors", "shipped", "widths", "laws",
                     "choice", "bounds", "online", "figures"}));
  verb->add_option("--draws", o->draws, "random draws of prior and noise")->check(AboveZero());
  verb->add_option("--slow-draws", o->slow_draws, "draws of the methods of (25), which take seconds each")
      ->check(AboveZero());
  verb->add_option("--seed", o->seed, "of all draws and searches");
  verb->add_option("--search-seconds", o->search_s,
                   "of each trajectory search at most; with time enough, results follow from the seed")
      ->check(AboveZero());
  verb->add_option("--searches", o->searches,
                   "starts of each trajectory search at most (default: 60, of (4) 12, of the genetic algorithm 2)")
      ->check(AboveZero());
  verb->add_option("--feedforward", o->feedforward,
                   "what the simulated controller knows: the set parameters, as in the survey, or CAD values")
      ->check(OneOf({"set", "cad"}))
      ->capture_default_str();
  verb->add_option("--robot", o->robot, "robot file or name: its CAD values are the set parameters");
  verb->add_option("--data", o->data, "folder of measured logs (default: measured in ARMCAL_DATA)");
  verb->add_option("--json", o->json, "write every table and goal here");
  verb->add_option("--report", o->report, "write the page here (HTML)");
  verb->callback([o, &action] { action = [o] { return RunSurvey(*o); }; });
}

}  // namespace armcal::tool
