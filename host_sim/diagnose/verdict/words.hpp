// verdict - says a diagnosis in words. Its text, its page and its JSON share them.
#pragma once

#include <string>
#include <vector>

#include "host_sim/diagnose/verdict/verdict.hpp"

namespace armcal::verdict {

// A curve that names no cause. Its joint is the one whose torque it changes; another joint may be among its signals.
inline bool IsUnknown(const diagnosis::Term& t) { return t.record->kind == "unknown"; }

// At least one term held on the held-out log.
bool AnyConfirmed(const diagnosis::Finding& finding);

// The verdict in one sentence; what it means in numbers is in the table of errors. strange: the held-out log leaves
// much more than the training logs do.
std::string Headline(const diagnosis::Finding& finding, bool strange = false);

// A joint on which the held-out log leaves more than twice what the training logs leave.
struct Strange {
  int joint;                  // from 0
  double held_out, training;  // RMS, N m or N
};
std::vector<Strange> StrangeJoints(const DiagnosisView& v);
// "joint 2: the held-out log leaves 2.21 N m, 40 times what the training logs leave. ..."
std::vector<std::string> StrangeText(const std::vector<Strange>& strange, const codegen::Robot& robot);

// "3", "5-6", "all", "base", "flange": how a report names the joints of a term.
std::string JointName(const diagnosis::Term& term);

// "5-6" of joints counted from 0.
std::string JointNumbers(const std::vector<int>& joints);

// "stribeck:2", "wrist_coupling:5-6", "base_tilt": an effect as armcal excite --separate takes it.
std::string EffectWord(const std::string& record, const std::vector<int>& joints);

// What must be said with a term's name: " (NOT CONFIRMED ...)", " (found on this trajectory, NOT CONFIRMED)", " (in the
// training log only)", or nothing.
std::string Remark(const diagnosis::Term& t);

// "vs2 = 0.08 +- 0.002 rad/s, ..."; a curve's first coefficients only.
std::string Parameters(const diagnosis::Term& t, const codegen::Robot& robot);

// "512 (noise alone gains as much in one search of 10^99, accepted from 10^5)", "improves 5 of 5 blocks ...",
// "presliding_dahl, joint 2 (score 480)".
std::string ScoreText(const diagnosis::Term& t);
std::string FoldText(const diagnosis::Term& t);
std::string RivalName(const diagnosis::Rival& rival);
std::string RunnerUp(const diagnosis::Term& t);
std::string AlsoFits(const diagnosis::Term& t);

// The term as a robot file would use its record, with the nonlinear parameters that were found; of several uses the
// first.
codegen::EffectUse Found(const diagnosis::Term& t);

// How to tell one term of the finding from its rivals. robot, verdict: the robot file and the JSON as the user named
// them; verdict may be empty.
std::vector<Separation> Separations(const diagnosis::Term& t, const diagnosis::Finding& finding,
                                    const codegen::Model& model, const codegen::Catalogue& records,
                                    const std::string& robot, const std::string& verdict);

// What the words say where there is no command.
inline constexpr const char* kNoMotion = "armcal excite cannot search a motion for it";

// "joint 3 is predicted worse with it than by the declared model: 0.412 instead of 0.398 N m"; of one not confirmed.
std::string WhyNotConfirmed(const diagnosis::Term& t, const codegen::Robot& robot);

// The order in which terms are shown: confirmed ones first, and of these the one with the most torque, measured by the
// error that all terms leave on its joint of the held-out log.
std::vector<std::size_t> OrderOfTerms(const DiagnosisView& v);

// What, on which joint, over which other one, and how much of the held-out error.
std::string CauseText(const DiagnosisView& v, std::size_t term);

// What to do about a term.
std::string WhatToDo(const diagnosis::Term& t);

// Both in one sentence.
std::string Sentence(const DiagnosisView& v, std::size_t term);

// What the held-out log carries and the training logs do not, a line each; empty if nothing is named.
std::vector<std::string> PayloadText(const DiagnosisView& v);

// Joints, counted from 0, that did not move in the training logs: a diagnosis says nothing of their own effects.
std::vector<int> Rested(const DiagnosisView& v);

// What this diagnosis could not see, a line each: the band, rows left out, joints that stood, a search that was cut
// off.
std::vector<std::string> NotLookedAt(const DiagnosisView& v);

// What the new model file makes of the term.
std::string InTheModel(const diagnosis::Term& t, const codegen::Robot& robot);

}  // namespace armcal::verdict
