// verdict - puts scores, rivals, and what would tell them apart into words.
#include "host_sim/diagnose/verdict/words.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_sim/diagnose/verdict/json_values.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "host_sim/identify/excitation/target.hpp"

namespace armcal::verdict {

using diagnosis::Rival;
using diagnosis::Term;

namespace {

std::string Value(const std::string& name, double value, double sd, const std::string& unit) {
  return fmt::format("{} = {:.4g}{}{}", name, value, sd > 0 ? fmt::format(" +- {:.2g}", sd) : "",
                     unit == "1" ? "" : " " + unit);
}

bool Apart(const std::vector<int>& a, const std::vector<int>& b) {
  return !a.empty() && !b.empty() &&
         std::none_of(a.begin(), a.end(), [&](int j) { return std::find(b.begin(), b.end(), j) != b.end(); });
}

// Averages have less noise than samples, and those of a lower band have less than those of a higher one.
bool HasRowsOfOneKind(const DiagnosisView& v, int j) {
  constexpr double kNear = 1.2;
  const auto band_Hz = [j](const calibration::Dataset& log) {
    return log.averaged(j) ? log.band_Hz[j] : double{INFINITY};
  };
  const double held_out_Hz = band_Hz(*v.test);
  return std::all_of(v.train->begin(), v.train->end(), [&](const calibration::Dataset& log) {
    const double own_Hz = band_Hz(log);
    return own_Hz == held_out_Hz || (own_Hz < kNear * held_out_Hz && held_out_Hz < kNear * own_Hz);
  });
}

}  // namespace

bool AnyConfirmed(const diagnosis::Finding& f) {
  return std::any_of(f.terms.begin(), f.terms.end(), [](const Term& t) { return t.confirmed; });
}

std::vector<Strange> StrangeJoints(const DiagnosisView& v) {
  constexpr double kMuch = 2;
  std::vector<Strange> out;
  const Eigen::VectorXd in_band = calibration::RmsInBand(*v.test, v.held_out->after),
                        at_samples = calibration::Rms(*v.test, v.held_out->after, true);
  for (int j = 0; j < in_band.size(); ++j) {
    const bool rows = HasRowsOfOneKind(v, j);
    const double left = rows ? in_band[j] : at_samples[j], trained = rows ? v.finding->sigma[j] : v.left_at_samples[j];
    if (trained > 0 && left > kMuch * trained) out.push_back({j, left, trained});
  }
  return out;
}

std::vector<std::string> StrangeText(const std::vector<Strange>& strange, const codegen::Robot& robot) {
  std::vector<std::string> lines;
  for (const Strange& s : strange)
    lines.push_back(
        fmt::format("joint {}: the held-out log leaves {:.3g} {}, {:.1f} times what the training logs leave",
                    s.joint + 1, s.held_out, calibration::TorqueUnit(robot.joint[s.joint]), s.held_out / s.training));
  if (!lines.empty())
    lines.emplace_back(
        "so the held-out log differs from the training logs: another load, temperature, cable, contact or arm; "
        "a log of the training logs' conditions as --test, or this log in --train, tells more");
  return lines;
}

std::string Headline(const diagnosis::Finding& f, bool strange) {
  if (f.terms.empty() && static_cast<Eigen::Index>(f.too_short.size()) == f.sigma.size())
    return "none. Nothing was searched: too few rows of the training logs are left; longer logs show more";
  if (f.terms.empty() && strange)
    return "none. The training logs lack nothing that they could show, but the held-out log differs from them";
  if (f.terms.empty())
    return "none. Nothing is missing that these logs could show; what they would have shown is in the table: smallest "
           "detectable effect";
  const auto any = [&](auto is) { return std::any_of(f.terms.begin(), f.terms.end(), is); };
  if (!AnyConfirmed(f) && any([](const Term& t) { return t.in_fit; }))
    return "none confirmed. The held-out log repeats a training trajectory: terms are found on this trajectory only";
  if (!AnyConfirmed(f) && any([](const Term& t) { return t.not_held_out; }))
    return "none. What the training logs suggested did not hold on the held-out log";
  if (!AnyConfirmed(f))
    return "none. The training logs suggest terms, but do not determine their parameters; longer logs show more";
  const bool of_the_arm =
      std::any_of(f.terms.begin(), f.terms.end(), [](const Term& t) { return t.confirmed && !t.training_only; });
  return of_the_arm ? "effect" : "effect, in the training log only: it says nothing about the arm";
}

std::string Remark(const Term& t) {
  if (!t.confirmed && t.in_fit) return " (found on this trajectory, NOT CONFIRMED)";
  if (!t.confirmed) return t.not_held_out ? " (NOT CONFIRMED on the held-out log)" : " (NOT CONFIRMED: not determined)";
  return t.training_only ? " (in the training log only)" : "";
}

std::string JointName(const Term& t) {
  if (t.joints.size() == 1 || IsUnknown(t)) return std::to_string(t.joints[0] + 1);
  return t.joints.empty() ? t.record->place : JointNumbers(t.joints);
}

std::string JointNumbers(const std::vector<int>& joints) {
  std::string out;
  for (const int j : joints) out += fmt::format("{}{}", out.empty() ? "" : "-", j + 1);
  return out;
}

std::string EffectWord(const std::string& record, const std::vector<int>& joints) {
  return record + (joints.empty() ? "" : ":") + JointNumbers(joints);
}

std::string Parameters(const Term& t, const codegen::Robot& robot) {
  constexpr std::size_t kShown = 4;
  std::vector<std::string> out;
  for (std::size_t k = 0; k < t.eta.size(); ++k)
    out.push_back(Value(t.unknowns[k].name, t.eta[k], t.eta_sd[static_cast<Eigen::Index>(k)],
                        UnitOn(robot, t.joints, t.unknowns[k].unit)));
  for (std::size_t c = 0; c < std::min(kShown, t.columns.size()); ++c)
    out.push_back(Value(t.columns[c].name, t.amplitude[static_cast<Eigen::Index>(c)],
                        t.sd[static_cast<Eigen::Index>(c)], UnitOn(robot, t.joints, t.columns[c].unit)));
  if (t.columns.size() > kShown) out.push_back("...");
  return fmt::format("{}", fmt::join(out, ", "));
}

std::string ScoreText(const Term& t) { return fmt::format("{:.0f} ({})", t.score, diagnosis::ChanceText(t)); }

std::string FoldText(const Term& t) {
  if (t.training_only) return "not judged on blocks that it was not fitted to: an event of one block is in no other";
  return fmt::format("improves {} of {} blocks of the training log that it was not fitted to",
                     (t.folds.array() > 0).count(), t.folds.size());
}

std::string RivalName(const Rival& rival) {
  return rival.record->name + ", joint " + (rival.joints.empty() ? rival.record->place : JointNumbers(rival.joints));
}

std::string RunnerUp(const Term& t) {
  if (t.rivals.empty()) return "none";
  const Rival& rival = t.rivals[0];
  const std::string name = fmt::format("{} (score {:.0f})", RivalName(rival), rival.score);
  if (!rival.refused.empty()) return fmt::format("{}, not taken: {}", name, rival.refused);
  if (rival.score <= t.score) return name;
  return fmt::format("{}; when both were tried this term scored {:.0f}, before the other terms took their share", name,
                     rival.beside);
}

std::string AlsoFits(const Term& t) {
  return t.also_fits.empty() ? "nothing else in the catalogue" : fmt::format("{}", fmt::join(t.also_fits, ", "));
}

codegen::EffectUse Found(const Term& t) {
  codegen::EffectUse use;
  use.effect = t.record->name, use.joints = t.joints;
  for (std::size_t k = 0; k < t.eta.size(); ++k) use.nonlinear.emplace(t.unknowns[k].key, t.eta[k]);
  return use;
}

std::vector<Separation> Separations(const Term& t, const diagnosis::Finding& finding, const codegen::Model& model,
                                    const codegen::Catalogue& records, const std::string& robot,
                                    const std::string& verdict) {
  std::vector<codegen::EffectUse> found;
  for (const Term& term : finding.terms)
    if (!term.eta.empty() && !verdict.empty()) found.push_back(Found(term));
  const auto is_found = [&](const codegen::EffectRecord& record, const std::vector<int>& joints) {
    return std::any_of(found.begin(), found.end(),
                       [&](const auto& use) { return use.effect == record.name && use.joints == joints; });
  };
  std::vector<Separation> out;
  for (const Rival& rival : t.rivals) {
    if (Apart(t.joints, rival.joints) || (rival.record == t.record && rival.joints == t.joints)) continue;
    Separation s{RivalName(rival), t.record->separate, ""};
    const std::string& other = rival.record->separate;
    if (other != s.how && !other.empty()) s.how += (s.how.empty() ? "" : "; ") + other;
    if (s.how.empty()) s.how = "motion in which what they depend on does not go together";
    const std::string one = EffectWord(t.record->name, t.joints),
                      another = EffectWord(rival.record->name, rival.joints);
    if (excitation::CanSeparate(model.robot(), records, {one, another}, found)) {
      s.command = fmt::format("armcal excite --separate {},{}", one, another);
      if (is_found(*t.record, t.joints) || is_found(*rival.record, rival.joints)) s.command += " --found " + verdict;
      s.command += fmt::format(" --robot {} --out separate.csv", robot);
    }
    out.push_back(s);
  }
  return out;
}

std::string WhyNotConfirmed(const Term& t, const codegen::Robot& robot) {
  if (!t.refuted) return t.unconfirmed;
  const diagnosis::Refutation& why = *t.refuted;
  const char* without = why.beside_others ? "with the other terms alone" : "by the declared model";
  if (why.joint < 0)
    return fmt::format(
        "all joints together are predicted worse with it than {}: the product of their errors is {:.4g} "
        "times as large",
        without, why.factor);
  return fmt::format("joint {} is predicted worse with it than {}: {:.4g} instead of {:.4g} {}", why.joint + 1, without,
                     why.with[why.joint], why.without[why.joint], calibration::TorqueUnit(robot.joint[why.joint]));
}

std::string InTheModel(const Term& t, const codegen::Robot& robot) {
  if (!t.confirmed)
    return (t.refuted ? "left out; refuted on the held-out log: " : "left out; ") + WhyNotConfirmed(t, robot);
  if (!t.record->on_target) return "no model can hold it: " + t.record->remedy;
  return t.record->search.at_turns
             ? "yes, with the values found here: it shows near turns and at rest, where filters do not learn"
             : "yes, as an estimated effect";
}

}  // namespace armcal::verdict
