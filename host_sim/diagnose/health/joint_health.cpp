// health - computes means from a joint's bins, explains their change, and finds the step in its history.
#include "host_sim/diagnose/health/joint_health.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace armcal::health {

namespace {

constexpr double kFewestRows = 64;       // in a bin; fewer are one passage
constexpr double kFewestKelvin = 5;      // of temperature span, to speak of temperature at all
constexpr int kTimeless = kTempCoulomb;  // shapes before it need no temperature
constexpr double kPriorInSigma = 3;      // how large a misfit of the first rows may be, a shape
using Means = std::array<double, kShapes>;

// Temperature of all rows, K above nothing; 0 without a sensor.
struct Warmth {
  double low = 0, high = 0;
  bool known = false;
  bool spans() const { return high - low >= kFewestKelvin; }
  double middle() const { return 0.5 * (low + high); }
};

Warmth WarmthOf(const client::JointResiduals& joint) {
  Warmth warmth;
  for (const client::ResidualBins* set : {&joint.reference, &joint.recent})
    for (const auto& direction : set->bin[link::reg::kResidualSignals - 1])
      for (const client::ResidualBin& b : direction) {
        if (b.count < kFewestRows) continue;
        const double t = b.temperature / b.count;
        warmth.low = warmth.known ? std::min(warmth.low, t) : t;
        warmth.high = warmth.known ? std::max(warmth.high, t) : t;
        warmth.known = true;
      }
  return warmth;
}

// Every row stands in one bin of each signal. With a quarter (third) of the weight, chi^2 is right even if those bins
// held the same rows; where they do not, it is too small, never too large.
std::optional<Evidence> MeanOf(const client::ResidualBin& b, int direction, const Warmth& warmth) {
  if (b.count < kFewestRows) return std::nullopt;
  const double sign = direction == 0 ? -1 : 1, share = 1 / b.count;
  Evidence e;
  e.rows = b.count;
  e.torque_Nm = b.residual * share;
  const double within = std::max(b.square * share - e.torque_Nm * e.torque_Nm, 1e-4 * b.square * share);
  e.variance = (warmth.known ? 4 : 3) * within * share;
  const double warmer = warmth.spans() ? b.temperature * share - warmth.middle() : 0;
  e.shape = {1,
             sign,
             b.speed * share,
             b.load * share,
             sign * b.load_size * share,
             b.position * share,
             sign * warmer,
             b.speed * share * warmer};
  return e;
}

// Visits each bin with its first rows, its latest rows and its direction.
template <class Visit>
void ForEachBin(const client::JointResiduals& joint, const Visit& visit) {
  for (int s = 0; s < link::reg::kResidualSignals; ++s)
    for (int d = 0; d < 2; ++d)
      for (int k = 0; k < link::reg::kResidualQuarters; ++k)
        visit(joint.reference.bin[s][d][k], joint.recent.bin[s][d][k], d);
}

// The misfit of the first rows as a sum of shapes, drawn to zero where they hardly show it.
Means Misfit(const std::vector<Evidence>& reference, double sigma_Nm) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kTimeless, kTimeless);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kTimeless), square = Eigen::VectorXd::Zero(kTimeless);
  double rows = 0;
  for (const Evidence& e : reference) {
    const Eigen::Map<const Eigen::VectorXd> x(e.shape.data(), kTimeless);
    normal += x * x.transpose() / e.variance;
    right += x * (e.torque_Nm / e.variance);
    square += e.rows * x.cwiseAbs2();
    rows += e.rows;
  }
  for (int k = 0; k < kTimeless; ++k) {
    const double prior = kPriorInSigma * sigma_Nm;
    normal(k, k) += std::max(square[k] / std::max(rows, 1.0), 1e-12) / (prior * prior);
  }
  const Eigen::VectorXd value = normal.ldlt().solve(right);
  Means misfit{};
  std::copy(value.begin(), value.end(), misfit.begin());
  return misfit;
}

// Over all rows of a set.
struct Overall {
  double rows = 0, mean_square = 0;
};

Overall OverallOf(const client::ResidualBins& bins) {
  Overall all;
  for (const auto& direction : bins.bin[0])
    for (const client::ResidualBin& b : direction) all.rows += b.count, all.mean_square += b.square;
  if (all.rows > 0) all.mean_square /= all.rows;
  return all;
}

// Of the first rows after the adoption: the residual itself.
std::vector<Evidence> ReferenceEvidence(const client::JointResiduals& joint) {
  const Warmth warmth = WarmthOf(joint);
  std::vector<Evidence> list;
  ForEachBin(joint, [&](const client::ResidualBin& first, const client::ResidualBin&, int direction) {
    if (const auto e = MeanOf(first, direction, warmth)) list.push_back(*e);
  });
  return list;
}

// Latest minus first rows, bin by bin: a misfit that was there from the start cancels. Where a bin's rows moved in the
// meantime (another program, a warmer joint), the difference that the shapes fitted to the first rows make is taken
// out.
std::vector<Evidence> ChangeEvidence(const client::JointResiduals& joint) {
  const Warmth warmth = WarmthOf(joint);
  const Means misfit = Misfit(ReferenceEvidence(joint), joint.sigma_Nm);
  std::vector<Evidence> list;
  ForEachBin(joint, [&](const client::ResidualBin& first, const client::ResidualBin& latest, int direction) {
    const auto before = MeanOf(first, direction, warmth), now = MeanOf(latest, direction, warmth);
    if (!before || !now) return;
    Evidence change = *now;
    change.torque_Nm -= before->torque_Nm;
    change.variance += before->variance;
    for (int k = 0; k < kTimeless; ++k) change.torque_Nm -= misfit[k] * (now->shape[k] - before->shape[k]);
    for (int k = kTimeless; k < kShapes; ++k) change.shape[k] -= before->shape[k];
    list.push_back(change);
  });
  return list;
}

constexpr double kExplained = 0.7;     // of the change; terms that leave more than the rest do not name it
constexpr double kCorrelatedRows = 8;  // in a row: a residual that is not white turns slower than samples come
constexpr double kGrowthSigmas = 4;

// The residual grew by more than chance explains, and by enough to be reported.
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
  if (now.rows < kFewestLatestRows) {
    // The latest rows are forgotten: of n of them, kMemory (1 - exp(-n / kMemory)) are left.
    const double latest = kMemory * std::log((1 - now.rows / kMemory) / (1 - kFewestLatestRows / kMemory));
    health.missing_rows = std::max(0.0, kReferenceRows - then.rows) + latest;
    return health;
  }

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

namespace {

struct Sum {
  double count = 0, square = 0;
  void Add(const client::ResidualSlice& s) { count += s.count, square += s.square; }
  double mean() const { return count > 0 ? square / count : 0; }
};

Sum Over(const std::vector<client::ResidualSlice>& slices, std::size_t first, std::size_t end) {
  Sum sum;
  for (std::size_t i = first; i < end; ++i) sum.Add(slices[i]);
  return sum;
}

}  // namespace

std::optional<Onset> FindOnset(const std::vector<client::ResidualSlice>& all, double elapsed_s) {
  std::vector<client::ResidualSlice> slices;  // in which the joint moved
  std::vector<double> end_s;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].count <= 0) continue;
    slices.push_back(all[i]);
    end_s.push_back(i + 1 < all.size() ? all[i + 1].start_s : elapsed_s);
  }
  std::optional<std::size_t> step;  // first slice after it
  double least = 0;
  for (std::size_t k = 1; k < slices.size(); ++k) {
    const Sum before = Over(slices, 0, k), after = Over(slices, k, slices.size());
    if (after.mean() <= before.mean() || before.mean() <= 0) continue;
    const double cost = before.count * std::log(before.mean()) + after.count * std::log(after.mean());
    if (!step || cost < least) step = k, least = cost;
  }
  if (!step) return std::nullopt;
  // The change may have begun inside either slice at the step; the part of the growth that is missing there says how
  // late. Levels are taken from the slices beyond them, as far as there are any.
  const std::size_t k = *step;
  const double low = Over(slices, 0, k > 1 ? k - 1 : k).mean();
  const double high = Over(slices, k + 1 < slices.size() ? k + 1 : k, slices.size()).mean();
  const auto changed_part = [&](std::size_t i) {
    return high > low ? std::clamp((slices[i].square / slices[i].count - low) / (high - low), 0.0, 1.0) : 1.0;
  };
  Onset onset{0, slices[k - 1].start_s, end_s[k]};
  onset.at_s = end_s[k] - changed_part(k) * (end_s[k] - slices[k].start_s) -
               changed_part(k - 1) * (end_s[k - 1] - slices[k - 1].start_s);
  return onset;
}

}  // namespace armcal::health
