// health - bin means, their variances, and what each shape gives in them.
#include "host_sim/diagnose/health/evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Dense>

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

// Visits the bins that `a` and `b` both have.
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

}  // namespace

Overall OverallOf(const client::ResidualBins& bins) {
  Overall all;
  for (const auto& direction : bins.bin[0])
    for (const client::ResidualBin& b : direction) all.rows += b.count, all.mean_square += b.square;
  if (all.rows > 0) all.mean_square /= all.rows;
  return all;
}

std::vector<Evidence> ReferenceEvidence(const client::JointResiduals& joint) {
  const Warmth warmth = WarmthOf(joint);
  std::vector<Evidence> list;
  ForEachBin(joint, [&](const client::ResidualBin& first, const client::ResidualBin&, int direction) {
    if (const auto e = MeanOf(first, direction, warmth)) list.push_back(*e);
  });
  return list;
}

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

}  // namespace armcal::health
