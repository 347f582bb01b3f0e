// survey - fills all of the survey's tables and figures from one robot file: Tables 5 to 12, Figures 1 to 4.
#pragma once

#include "host_sim/study/survey/cad_error.hpp"
#include "host_sim/study/survey/draws.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// The lists of methods that the tables show, the survey's own first.
const std::vector<std::string>& OwnLinear();
const std::vector<std::string>& OwnNonlinear();
const std::vector<std::string>& BetterLinear();
const std::vector<std::string>& BetterNonlinear();

// The results from which Table 11 is made.
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
// The better methods under every prior, and the goals that they must reach.
void ShowPriors(const Settings& settings, const Motions& motions, Findings& out);
// The prior of the robot file as it ships on logs of the plant, under errors of the CAD values that it is not told.
void ShowShippedPrior(const Settings& settings, const Motions& motions, Findings& out);
// The same under every kind and width of error and after 10, 40 and 120 s. It takes hours with many draws, so only who
// asks for it by name gets it.
void ShowWidths(const Settings& settings, const Motions& motions, Findings& out);
// Friction laws of joints found again in logs of the plant.
void ShowLaws(const Settings& settings, const Motions& motions, Findings& out);
// Whether `armcal choose` finds the law that a joint has.
void ShowChoice(const Settings& settings, const Motions& motions, Findings& out);
// The firmware's own estimator on fresh draws, and whether it reports that its deviations cannot be trusted.
void ShowOnline(const Settings& settings, const Motions& motions, Findings& out);
// Base parameters of each estimator against the bound that applies.
void ShowBounds(const Settings& settings, const Motions& motions, Findings& out);
// Table 10: in the closed loop, and without one.
void ShowDifferentiation(const Settings& settings, const Motions& motions, Findings& out);
void ShowInstruments(const Settings& settings, const Motions& motions, Findings& out);
// Figure 4; fills in evidence.follow_*.
void ShowTracking(const Settings& settings, const Motions& motions, Evidence& evidence, Findings& out);
// Table 11.
void ShowLevels(const Settings& settings, const Evidence& evidence, Findings& out);
// What the load column of (9) adds to the rigid columns.
void ShowLoad(const Settings& settings, const Motions& motions, Findings& out);
// Table 12, simulated and on measured logs.
void ShowModels(const Settings& settings, const Motions& motions, Findings& out);
// Figures 1 and 3.
void ShowArm(const Settings& settings, Findings& out);
// The survey's mistakes, and what armcal does instead.
Sheet Slips();

// Runs the survey: searches the trajectories and fills every table asked for, with the printed figures beside ours.
// When settings.stop is set, it stops early with what it has. io::InputError: the robot has no motion within its
// limits, or measured logs cannot be read.
Findings RunSurvey(const Settings& settings);

}  // namespace armcal::survey
