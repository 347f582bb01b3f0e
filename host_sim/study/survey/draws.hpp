// survey - draws priors and truths at random, and runs methods over many draws, with and without noise.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "host_sim/study/survey/arm.hpp"
#include "host_sim/study/survey/data_files.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/trial.hpp"

namespace armcal::survey {

// How far the CAD values lie from the truth. kWorst: each entry is multiplied by 1 + width or 1 - width. kUniform: by a
// number between these.
struct PriorError {
  enum Kind { kWorst, kUniform } kind = kUniform;
  double width = 0.2;
};
std::string PriorName(const PriorError& error);  // "uniform +-20 %"
// Relative standard deviation of such an error. Methods are told it.
double RelativeDeviation(const PriorError& error);

// The robot as CAD gives it: m, c, I about the centre of every link, friction, and means of effects, each with an
// error. A body that cannot exist is drawn again. The [prior] deviations are those of the error, without floors.
codegen::Robot DrawPrior(const codegen::Robot& truth, const PriorError& error, std::uint64_t seed);

// A truth for (4): qs log-uniform in 0.05 .. 0.2 rad/s, Fs / Fc in 1.1 .. 1.5, per joint.
Stribeck DrawStribeck(int joints, std::uint64_t seed);
// The middle of that range, which is believed before the draw.
Stribeck BelievedStribeck(int joints);

// A filter is told that no parameter changes while it runs, as in (18), (19) and (21).
codegen::Catalogue WithoutProcessNoise(codegen::Catalogue records);

struct Settings {
  codegen::Robot robot;        // its CAD and friction are the set parameters phi_s
  codegen::Catalogue records;  // as read; Records() is applied by the survey
  Levels levels;
  Printed printed;
  std::string home;      // the folder of codegen/ and host_sim/: channel maps and robots of measured logs
  std::string measured;  // folder of measured logs; empty: Table 12 on real machines is left out
  int draws = 200;       // of prior, noise and, where drawn, truth
  int slow_draws = 5;    // of the methods of (25)
  std::uint64_t seed = 1;
  bool cad_feedforward = false;  // the loop's controller uses CAD values instead of the set parameters
  double search_s = 55;          // of each trajectory search at most; given enough time, the seed decides the results
  int searches = 0;              // starts of each trajectory search at most; 0: as many as it has
  std::vector<std::string> tables;  // "5" .. "12", "figures"; empty: all but "widths"
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const std::string& what, double share)> progress = [](const std::string&, double) {};

  bool Names(const std::string& table) const;
  bool Wants(const std::string& table) const { return tables.empty() || Names(table); }
  bool Stopped() const { return stop && *stop; }
};

// The trajectories that all tables share.
struct Motions {
  ExcitedBy linear, nonlinear;
  ExcitedBy friction;             // of (4), searched for small deviations of friction; only if a table has it
  std::vector<ExcitedBy> others;  // for the table of trajectories alone
  excitation::Series other;       // for validation: nothing is fitted to it
};
// The same, with the motion that is searched for friction in the place of `nonlinear`.
Motions AlongFriction(Motions motions);

struct DrawSettings {
  Law law = Law::kCoulombViscous;
  PriorError prior;
  bool random_truth = false;  // qs and Fs / Fc of (4) are drawn, too
  bool analytic = false;      // drawn truths in the survey's form instead of the plant
  int draws = 20, slow_draws = 5;
  std::uint64_t seed = 1;
  double clean_sigma = 1;  // share of Table 7's sigma that a method is told for noise-free data
};

// One method over the draws; entry d of clean and noisy belongs to the same prior.
struct Outcome {
  std::string name, title, equation;
  std::vector<Score> clean, noisy;
  std::vector<double> delta, delta_true;     // Delta J_e; the same against noise-free torque of the other motion
  calibration::Solution first, first_noisy;  // of draw 1, for Tables 5 and 6
  int failed = 0;                            // solves that gave no finite parameters
  std::string why;                           // the first failure, or why the method refused
};

// The plant with a friction law and these Stribeck parameters. Bodies, Coulomb and viscous friction are the file's. The
// law: kCoulombViscous or kStribeck.
std::unique_ptr<Truth> MakeTruth(const Settings& settings, const Motions& motions, Law law, const Stribeck& stribeck);

// Calls work(0) .. work(count - 1) on all cores, unless stopped, and shows progress.
void ForEachDraw(const Settings& settings, const std::string& what, int count, const std::function<void(int)>& work);

// Runs on all cores. The methods of (25) take seconds each, so they get `slow_draws`.
std::vector<Outcome> RunDraws(const Settings& settings, const Motions& motions, const DrawSettings& draws,
                              const std::vector<std::string>& methods);

}  // namespace armcal::survey
