// diagnosis - puts a column of each candidate into the rows of the final fit, and scales it until it is accepted.
#include "host_sim/diagnose/diagnosis/limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/diagnose/diagnosis/search.hpp"
#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

namespace {

constexpr double kTried = 10;       // members of a usual grid
constexpr double kRounding = 1e-4;  // of a column's own square: so little beside the declared model is rounding

// What a term must gain to be accepted.
double Needed(Candidate& c, const std::vector<double>& eta, const Evidence& evidence, double log_limit) {
  Found f;
  f.candidate = &c;
  f.tried = c.unknowns().empty() ? 1 : kTried;
  f.gain.rank = c.columns(eta);
  f.searched = static_cast<int>(c.unknowns().size());
  f.penalty = PenaltyOf(f.gain.rank + f.searched, c, evidence);
  return std::max(GainOfChance(f, log_limit), GainOfScore(f));
}

}  // namespace

std::vector<Limit> DetectionLimits(Diagnosis::Work& w) {
  const std::vector<const Chosen*> terms = Confirmed(w.chosen);
  w.Solve(terms);
  w.FollowEstimate(w.all_reads);
  w.Prepare(terms);
  std::vector<NoiseModel> noise;
  {
    const Metric white(w.rows, w.WhiteNoise());
    for (int j = 0; j < w.model.joints(); ++j) noise.push_back(FitNoise(w.rows.index[j], white.RawResidual(j)));
  }
  const Metric metric(w.rows, noise);
  std::vector<Limit> out;
  for (const auto& c : w.candidates) {
    const codegen::SearchWay how = c->record().search.how;
    const bool is_chosen =
        std::any_of(terms.begin(), terms.end(), [&](const Chosen* t) { return t->candidate == c.get(); });
    if (is_chosen || c->is_event() || c->is_curve() || how == codegen::SearchWay::kOnset ||
        c->record().search.at_turns || !IsExcited(*c, w.evidence))
      continue;
    const std::vector<double> eta = c->Initial();
    const Columns columns = GatherColumns(*c, w.evidence, eta);
    const double needed = Needed(*c, eta, w.evidence, LogLimit(c->record(), *w.train[0]));
    Limit limit{&c->record(), c->joints(), c->rows()[0], std::numeric_limits<double>::infinity()};
    for (int k = 0; k < columns.count(); ++k) {
      const VectorXd a = VectorXd::Unit(columns.count(), k);
      // The joint on which the column's torque is largest names the size.
      int largest = -1;
      double size = 0;
      for (std::size_t r = 0; r < columns.joints.size(); ++r) {
        const VectorXd torque = columns.block[r].col(k);
        const double rms = torque.size() ? torque.norm() / std::sqrt(static_cast<double>(torque.size())) : 0;
        if (rms > size) size = rms, largest = columns.joints[r];
      }
      if (largest < 0) continue;
      const double seen = metric.Imitates(columns, columns, a).second;
      const auto at = static_cast<std::size_t>(largest);
      const double own = w.rows.index[at].size() * std::pow(size / noise[at].innovation, 2);
      if (!(seen > kRounding * own)) continue;
      const double rms = size * std::sqrt(needed / seen);
      if (rms < limit.rms_Nm) limit.rms_Nm = rms, limit.joint = largest;
    }
    out.push_back(limit);
  }
  std::stable_sort(out.begin(), out.end(), [](const Limit& a, const Limit& b) {
    return a.joint != b.joint ? a.joint < b.joint : a.rms_Nm < b.rms_Nm;
  });
  return out;
}

VectorXd TypicalLimits(const std::vector<Limit>& limits, int joints) {
  VectorXd out = VectorXd::Constant(joints, std::numeric_limits<double>::infinity());
  for (int j = 0; j < joints; ++j) {
    std::vector<double> own;
    for (const Limit& l : limits)
      if (l.joint == j && std::isfinite(l.rms_Nm)) own.push_back(l.rms_Nm);
    if (!own.empty()) out[j] = Median(std::move(own));
  }
  return out;
}

}  // namespace armcal::diagnosis
