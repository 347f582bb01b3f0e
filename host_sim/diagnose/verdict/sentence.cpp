// verdict - says a term in one sentence, and what the diagnosis did not look at.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/verdict/curves.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/words.hpp"
#include "host_sim/identify/calibration/log_check.hpp"

namespace armcal::verdict {

using diagnosis::Term;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kStands = 0.01;  // of the samples: a joint that moves less has told nothing

// [n] RMS of the term over RMS of the error that all terms leave, where the joint moves.
VectorXd OverError(const DiagnosisView& v, std::size_t term) {
  return calibration::Rms(*v.test, v.term_torque[term], true)
      .cwiseQuotient(calibration::Rms(*v.test, v.held_out->after, true).cwiseMax(1e-300));
}

// "joint 5, over the motion of joint 1", or "joint 3, with torque on joints 2 and 4, too". torque: [n] RMS of the term.
std::string Where(const Term& t, const VectorXd& torque) {
  std::vector<int> on, over;
  for (int j = 0; j < torque.size(); ++j)
    if (torque[j] > 0) on.push_back(j);
  if (t.joints.empty()) return t.record->place == "all" ? "all joints" : "the " + t.record->place;
  if (on.empty()) return "joint " + JointName(t);
  for (const int j : t.joints)
    if (std::find(on.begin(), on.end(), j) == on.end()) over.push_back(j);
  if (t.joints.size() == 1 && over.empty() && on.size() > 1) {
    std::erase(on, t.joints[0]);
    return fmt::format("joint {}, with torque on joint{} {}, too", JointName(t), on.size() > 1 ? "s" : "",
                       JointGroup(on));
  }
  std::string out = (on.size() > 1 ? "joints " : "joint ") + JointGroup(on);
  if (!over.empty()) out += ", over the motion of joint " + JointGroup(over);
  return out;
}

// "; joint 7 moves in phase with joints 1 and 3: it may belong to one of these": of what the term depends on.
std::string InPhase(const Term& t, const calibration::HeldOutMotion& motion) {
  std::string out;
  for (const auto& group : motion.in_phase)
    for (const int j : t.joints) {
      if (std::find(group.joints.begin(), group.joints.end(), j) == group.joints.end()) continue;
      std::vector<int> others = group.joints;
      std::erase(others, j);
      out += fmt::format("; joint {} moves in phase with joint{} {}, so it may depend on {}", j + 1,
                         others.size() > 1 ? "s" : "", JointGroup(others),
                         others.size() > 1 ? "one of these" : "that one");
    }
  return out;
}

}  // namespace

std::vector<std::size_t> OrderOfTerms(const DiagnosisView& v) {
  std::vector<std::size_t> order;
  std::vector<double> size;
  for (std::size_t k = 0; k < v.finding->terms.size(); ++k)
    order.push_back(k), size.push_back(OverError(v, k).maxCoeff());
  const auto confirmed = [&](std::size_t k) { return v.finding->terms[k].confirmed; };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return confirmed(a) != confirmed(b) ? confirmed(a) : size[a] > size[b];
  });
  return order;
}

std::string WhatToDo(const Term& t) {
  if (t.training_only || (!t.record->on_target && t.confirmed)) return t.record->remedy;
  if (!t.confirmed && t.in_fit) return "hold out a log of another trajectory to confirm it";
  if (!t.confirmed) return "leave it out";
  if (t.also_fits.empty()) return "put it in the model (--model-out)";
  return fmt::format("it may be used for prediction (--model-out), but these logs do not tell it from {}",
                     fmt::join(t.also_fits, " or "));
}

std::string CauseText(const DiagnosisView& v, std::size_t term) {
  const Term& t = v.finding->terms[term];
  const VectorXd torque = calibration::Rms(*v.test, v.term_torque[term], true);
  std::string out = fmt::format("{} on {}", t.record->kind, Where(t, torque));
  if (t.in_fit && !t.training_only && torque.maxCoeff() > 0) {
    Eigen::Index main = 0;
    const VectorXd after = calibration::Rms(*v.test, v.held_out->after, true),
                   before = calibration::Rms(*v.test, v.held_out->before, true);
    OverError(v, term).maxCoeff(&main);
    const char* unit = calibration::TorqueUnit(v.model->robot().joint[static_cast<std::size_t>(main)]);
    out += fmt::format(
        ": {:.3g} {} RMS of joint {} on the held-out log beyond what declared parameters can give; the error there is "
        "{:.3g} {} with the declared model and {:.3g} {} with all terms",
        torque[main], unit, main + 1, before[main], unit, after[main], unit);
    if (t.record->search.at_turns) out += "; it shows near turns and at rest, where a joint that sticks looks the same";
    out += InPhase(t, v.motion);
  } else if (t.training_only) {
    out += ": explains a time of the training log";
  } else if (!t.confirmed) {
    out += t.refuted        ? ": the held-out log refutes it"
           : t.not_held_out ? ": the held-out log does not show it"
                            : ": the training logs do not determine it";
  }
  return out;
}

std::string Sentence(const DiagnosisView& v, std::size_t term) {
  return CauseText(v, term) + "; " + WhatToDo(v.finding->terms[term]) + ".";
}

namespace {

// "9.7, 20.1 and 28.3": a joint's error over its torque on the rows that are fitted, in per cent.
std::string Shares(const VectorXd& error, const VectorXd& torque) {
  std::string out;
  for (Eigen::Index j = 0; j < error.size(); ++j)
    out += fmt::format("{}{:.1f}", j == 0 ? "" : ", ", 100 * error[j] / std::max(torque[j], 1e-12));
  return out + fmt::format(" % (mean {:.1f} %)", 100 * error.cwiseQuotient(torque.cwiseMax(1e-12)).mean());
}

}  // namespace

std::vector<std::string> PayloadText(const DiagnosisView& v) {
  const calibration::Carried& load = v.held_out->payload;
  if (!load.named) return {};
  std::vector<std::string> out;
  const double mass_kg = std::abs(load.mass_kg);
  out.push_back(fmt::format(
      "payload at the flange: the held-out log carries {:.3g} +- {:.2g} kg {} than the training logs (its halves: "
      "{:.3g} and {:.3g} kg); centre {:.3f} {:.3f} {:.3f} m from the flange",
      mass_kg, load.sd_kg, load.mass_kg > 0 ? "more" : "less", std::abs(load.half[0][0]), std::abs(load.half[1][0]),
      load.load[1] / load.mass_kg, load.load[2] / load.mass_kg, load.load[3] / load.mass_kg));
  const auto [low_kg, high_kg] = load.interval_kg;
  const double from_kg = std::min(std::abs(low_kg), std::abs(high_kg)),
               to_kg = std::max(std::abs(low_kg), std::abs(high_kg));
  out.push_back(fmt::format(
      "{}its mass is {:.3g} to {:.3g} kg if each joint's torque is right to {:.3g} %{}",
      load.tolerance_stated ? ""
                            : "the robot file states no gain tolerance, so mass is known only up to the torque scale: ",
      from_kg, to_kg, 100 * load.tolerance, load.tolerance_stated ? "" : " (--gain-tolerance)"));
  const VectorXd torque = calibration::RmsInBand(*v.test, v.test->tau);
  out.push_back("error of each half with the payload of the other half, over torque: " +
                Shares(calibration::RmsInBand(*v.test, v.held_out->after), torque) +
                "; without it: " + Shares(calibration::RmsInBand(*v.test, v.held_out->without_payload), torque));
  return out;
}

std::vector<int> Rested(const DiagnosisView& v) {
  std::vector<int> out;
  if (!v.train || v.train->empty()) return out;
  for (int j = 0; j < v.model->joints(); ++j) {
    double samples = 0, moving = 0;
    for (const calibration::Dataset& d : *v.train) moving += d.moving.col(j).sum(), samples += d.samples();
    if (moving < kStands * samples) out.push_back(j);
  }
  return out;
}

namespace {

// Of joints that the terms predict better where they move, and worse over all samples; empty if there is none.
std::string WorseAtRest(const DiagnosisView& v) {
  constexpr double kWorse = 1.02;
  const auto rms = [&](const MatrixXd& residual, bool moving) { return calibration::Rms(*v.test, residual, moving); };
  const VectorXd before = rms(v.held_out->before, false), after = rms(v.held_out->after, false),
                 moved = rms(v.held_out->before, true) - rms(v.held_out->after, true);
  std::string out;
  for (int j = 0; j < v.model->joints(); ++j)
    if (moved[j] > 0 && after[j] > kWorse * before[j])
      out += fmt::format("{}joint {} from {:.4g} to {:.4g} {}", out.empty() ? "" : ", ", j + 1, before[j], after[j],
                         calibration::TorqueUnit(v.model->robot().joint[static_cast<std::size_t>(j)]));
  if (out.empty()) return out;
  return fmt::format(
      "friction at rest: the terms lower the error where a joint moves, but over all held-out samples it grows ({}); no "
      "term describes a joint that stands",
      out);
}

}  // namespace

std::vector<std::string> NotLookedAt(const DiagnosisView& v) {
  std::vector<std::string> out;
  if (!v.train || v.train->empty()) return out;
  const int n = v.model->joints();
  std::string band, left_out;
  const VectorXd reach_Hz = LookedAtTo_Hz(v);
  double saved_Hz = INFINITY;
  for (int j = 0; j < n; ++j) {
    double used = 0, samples = 0;
    for (const calibration::Dataset& d : *v.train) {
      if (j < d.saved_Hz.size()) saved_Hz = std::min(saved_Hz, d.saved_Hz[j]);
      const auto& turned = v.finding->at_turns;
      const bool all = std::find(turned.begin(), turned.end(), j) != turned.end();
      used += (all ? d.sound : d.used).col(j).sum(), samples += d.samples();
    }
    band += fmt::format("{}{:.3g}", j == 0 ? "" : ", ", reach_Hz[j]);
    left_out += fmt::format("{}{:.0f}", j == 0 ? "" : ", ", 100 * (1 - used / std::max(samples, 1.0)));
  }
  if ((*v.train)[0].cutoff_Hz.size() == n)
    out.push_back(fmt::format(
        "motion faster than {} Hz (joints 1 to {}): above that the derived speeds and accelerations are filtered or "
        "mostly noise",
        band, n));
  if (const calibration::TorqueChannel& channel = (*v.train)[0].channel; !channel.empty()) {
    std::string each;
    int lags = 1;
    for (const calibration::JointChannel& c : channel) {
      each += fmt::format("{}{:.3g} / {:.2g}", each.empty() ? "" : ", ", 1000 * c.lag_s, 1000 * c.late_s);
      lags = std::max(lags, c.lags);
    }
    out.push_back(
        fmt::format("the torque before it was filtered: the logged one passed {} and a delay, time constant / delay "
                    "in ms {} (joints 1 to {}); predictions pass the same before they are compared",
                    lags == 1 ? "a low-pass" : "two equal low-passes", each, n));
  }
  if (std::isfinite(saved_Hz))
    out.push_back(fmt::format("torque above {:.3g} Hz: it was filtered away before the logs were saved", saved_Hz));
  out.push_back(fmt::format(
      "rows at rest, near a turn, beside jolts and beside gaps: {} % of the samples of joints 1 to {}; presliding "
      "and breakaway show there",
      left_out, n));
  if (std::string worse = WorseAtRest(v); !worse.empty()) out.push_back(std::move(worse));
  if (const std::vector<int> rested = Rested(v); !rested.empty())
    out.push_back(
        fmt::format("joint{} {}: at rest in the training logs", rested.size() > 1 ? "s" : "", JointGroup(rested)));
  if (const auto& few = v.finding->too_short; !few.empty())
    out.push_back(
        fmt::format("effects on joint{} {}: too few rows of the training logs are left; longer logs show more",
                    few.size() > 1 ? "s" : "", JointGroup(few)));
  if (v.finding->most_terms > 0)
    out.push_back(fmt::format("further terms: the search ended at {}; another diagnosis of the new model would go on",
                              v.finding->most_terms));
  return out;
}

}  // namespace armcal::verdict
