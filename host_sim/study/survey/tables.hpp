// survey - fills all of the survey's tables and figures from one robot file: Tables 5 to 12, Figures 1 to 4.
#pragma once

#include "host_sim/study/survey/draws.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// The lists of methods that the tables show, the survey's own first.
const std::vector<std::string>& OwnLinear();
const std::vector<std::string>& OwnNonlinear();
const std::vector<std::string>& BetterLinear();
const std::vector<std::string>& BetterNonlinear();

// What Table 11 is made of.
struct Evidence {
  std::vector<Outcome> linear, nonlinear;
  std::map<std::string, double> follow_slope, follow_step;  // method -> relative RMS after settling
};

// Section 6.1 and Figure 2: condition numbers and trajectories.
void ShowTrajectories(const Settings& settings, const Motions& motions, Findings& out);
// Tables 5 and 6: joint 3's parameters, from the first draw without noise.
void ShowParameters(const Settings& settings, const Motions& motions, const Evidence& evidence, Findings& out);
// Tables 7, 8 and 9.
void ShowErrors(const Settings& settings, const Evidence& evidence, Findings& out);
// The better methods under every prior, and the goals that they are to reach.
void ShowPriors(const Settings& settings, const Motions& motions, Findings& out);
// The firmware's own estimator on fresh draws, and whether it knows when not to be believed.
void ShowOnline(const Settings& settings, const Motions& motions, Findings& out);
// Table 10: in the closed loop, and without one.
void ShowDifferentiation(const Settings& settings, const Motions& motions, Findings& out);
void ShowInstruments(const Settings& settings, const Motions& motions, Findings& out);
// Figure 4; fills in evidence.follow_*.
void ShowTracking(const Settings& settings, const Motions& motions, Evidence& evidence, Findings& out);
// Table 11.
void ShowLevels(const Settings& settings, const Evidence& evidence, Findings& out);
// What (9) adds to the rigid columns.
void ShowLoad(const Settings& settings, const Motions& motions, Findings& out);
// Table 12, simulated and on measured logs.
void ShowModels(const Settings& settings, const Motions& motions, Findings& out);
// Figures 1 and 3.
void ShowArm(const Settings& settings, Findings& out);
// Where the survey slips, and what was done about it.
Sheet Slips();

// Searches the trajectories and fills every table asked for, printed figures beside ours. Stops early, with what it
// has, when settings.stop is set. io::InputError: a robot without motion within its limits, measured logs that cannot
// be read.
Findings RunSurvey(const Settings& settings);

}  // namespace armcal::survey
