// health - the verdict on one joint.
#include "host_sim/diagnose/health/joint_health.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/health/evidence.hpp"

namespace armcal::health {
namespace {

constexpr double kExplained = 0.7;     // of the change; terms that leave more than the rest do not name it
constexpr double kCorrelatedRows = 8;  // in a row: a residual that is not white turns slower than samples come
constexpr double kGrowthSigmas = 4;

// More than chance and more than is worth speaking of.
bool Grew(const Overall& then, const Overall& now, double smallest_Nm) {
  const auto variance = [](const Overall& o) { return 2 * kCorrelatedRows * o.mean_square * o.mean_square / o.rows; };
  const double growth = now.mean_square - then.mean_square;
  return growth > smallest_Nm * smallest_Nm && growth > kGrowthSigmas * std::sqrt(variance(then) + variance(now));
}

Explanation Named(Explanation found) {
  if (found.share < kExplained) found.terms.clear();
  return found;
}

}  // namespace

JointHealth Judge(const client::JointResiduals& joint) {
  const Overall then = OverallOf(joint.reference), now = OverallOf(joint.recent);
  JointHealth health;
  health.joint = joint.joint;
  health.elapsed_s = joint.elapsed_s;
  health.sigma_Nm = joint.sigma_Nm;
  health.rows = then.rows + now.rows;
  health.rms_then_Nm = std::sqrt(then.mean_square);
  health.rms_now_Nm = std::sqrt(now.mean_square);
  if (now.rows < kFewestLatestRows) return health;

  const double smallest = kSmallestInSigma * joint.sigma_Nm;
  const Explanation change = Explain(ChangeEvidence(joint), smallest);
  const bool larger = now.mean_square > then.mean_square;
  if (larger && (Grew(then, now, smallest) || !change.terms.empty())) {
    health.verdict = Verdict::kNoLongerFits;
    health.looks_like = Named(change);
    health.onset = FindOnset(joint.slices, joint.elapsed_s);
  } else if (health.rms_then_Nm > kNeverInSigma * joint.sigma_Nm) {
    health.verdict = Verdict::kNeverFitted;
    health.looks_like = Named(Explain(ReferenceEvidence(joint), smallest));
  } else {
    health.verdict = Verdict::kFits;
  }
  return health;
}

std::vector<int> ChangedTogether(const std::vector<JointHealth>& joints) {
  std::vector<int> together;
  double earliest_s = 0, latest_s = 0;  // what their onsets have in common
  for (const JointHealth& h : joints) {
    const auto& terms = h.looks_like.terms;
    const bool load =
        terms.empty() || terms[0].shape == kOffset || terms[0].shape == kGain || terms[0].shape == kPosition;
    if (h.verdict != Verdict::kNoLongerFits || !h.onset || !load) continue;
    earliest_s = together.empty() ? h.onset->earliest_s : std::max(earliest_s, h.onset->earliest_s);
    latest_s = together.empty() ? h.onset->latest_s : std::min(latest_s, h.onset->latest_s);
    together.push_back(h.joint);
  }
  if (together.size() < 2 || earliest_s > latest_s) together.clear();
  return together;
}

}  // namespace armcal::health
