// tool - the options of armcal survey.
#include "host_sim/tool/survey_verb.hpp"

#include <memory>

#include "host_sim/tool/command_line.hpp"

namespace armcal::tool {

void AddSurveyVerb(CLI::App& app, Action& action, std::function<int(const SurveyOptions&, const CLI::App&)> run) {
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
  verb->callback([o, verb, run, &action] { action = [o, verb, run] { return run(*o, *verb); }; });
}

}  // namespace armcal::tool
