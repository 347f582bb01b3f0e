// verdict - finds the terms that hold whichever run of an arm is held out, and shows them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/diagnose/verdict/common_rows.hpp"
#include "host_sim/diagnose/verdict/spread.hpp"
#include "host_sim/diagnose/verdict/verdict_file.hpp"

namespace armcal::verdict {

// A term as one split has it. Its joint is the one whose error it lowers most; errors are RMS where that joint moves.
// other_joint: the other joint whose error the terms of the split change for the worst; change: after over before, less
// one. -1: there is none.
struct Occurrence {
  std::string held_out;
  std::size_t place = 0;  // in the verdict's list of terms
  std::string kind;
  int joint = 0;                              // 0-based
  double before = 0, after = 0, without = 0;  // without: after, with this term's torque put back
  int other_joint = -1;
  double change = -1;
  nlohmann::ordered_json term;  // as in the verdict
};

struct Agreement {
  std::vector<std::string> kinds;  // that every split allows; empty: one split only has a curve over these signals
  std::string joint;
  std::vector<std::string> signals;
  std::vector<Occurrence> split;                           // one a held-out run
  double apart = 0;                                        // of the two that differ most: as Distance::share
  std::vector<std::pair<std::string, Spread>> parameters;  // by name; empty where the splits have different ones
  std::pair<std::string, Spread> size;  // RMS of the traces on the joint of the first split; no name: unknown
};

// What the splits' verdicts do not hold themselves.
struct Comparison {
  Traces traces;
  std::map<std::string, int> group;  // of runs that are held out together; a run not in it is a group by itself
};

struct Disagreement {
  std::string held_out, kind, joint, why;
};

// A term holds if every split found it from its training runs alone: on the same joint or pair of joints, of the same
// kind (or kinds that fit equally, or a curve over the same signals), and of the same form: on the same samples, beside
// what the declared model takes up, any two of them differ by less than half of the larger. The held-out run must have
// confirmed it, and there it takes half a per cent off a joint's error: of the declared model's, and of the model's
// without it.
struct Agreed {
  std::vector<Agreement> holds;
  std::vector<Disagreement> does_not;
};
Agreed Agree(const Verdicts& splits, const Comparison& comparison);

// "gravity_spring or cable_pack", or "unknown over qd1".
std::string Name(const Agreement& agreement);

std::string SplitsText(const Verdicts& splits, const Agreed& agreed);

// {"verdict", "holds": [{"kinds", "joint", "signals", "splits": {run: {"kind", "torque_of", "before", "after",
// "without", "other_joint", "other_change", "parameters", "score", "folds"}}, "apart", "parameters": {name: {"mean",
// "sd", "between_runs_sd", "interval_95"}}, "rms_Nm": the same of the size}], "does_not_hold": [{"held_out", "kind",
// "joint", "why"}], "splits": {run: {"before_moving", "after_moving", "torque_moving"} or {"error"}}}
nlohmann::ordered_json SplitsJson(const Verdicts& splits, const Agreed& agreed);

// errors.svg: error over torque of every held-out run; term_1.svg, ...: what holds, over the signal it depends on.
void WritePictures(const std::filesystem::path& folder, const Verdicts& splits, const Agreed& agreed);

void WriteSplitsPage(const std::filesystem::path& path, const std::string& robot, const Verdicts& splits,
                     const Agreed& agreed);

}  // namespace armcal::verdict
