// diagnosis - refines the parameters of all terms together, and computes how sure they are.
#include <algorithm>
#include <cmath>

#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kStep = 1e-3;    // of an unknown's range or size, for the slope of its columns
constexpr double kWider = 4;      // times, from one tried step to the next
constexpr double kWidest = 0.1;   // of the range or size: no wider step is tried
constexpr double kBlock_s = 0.5;  // over which noise may hang together

// What the term's torque changes by per unit of its unknown number k. The step grows until the change shows above the
// noise: a landing or a switch falls on a sample, and a smaller step moves none.
Columns Slope(const Chosen& term, const VectorXd& amplitude, std::size_t k, const Diagnosis::Work& w) {
  const auto& unknown = term.candidate->unknowns()[k % term.candidate->unknowns().size()];
  const double size = std::min(unknown.upper - unknown.lower,
                               unknown.logarithmic ? std::abs(term.eta[k]) : unknown.upper - unknown.lower);
  VectorXd held = amplitude;  // of a delay that has been applied the column is zero, and so is its estimate
  for (int c = 0; c < held.size(); ++c)
    if (term.candidate->column(c).fixed_amplitude) held[c] = term.candidate->column(c).amplitude;
  for (double share = kStep;; share *= kWider) {
    const double step = share * size;
    std::vector<double> eta = term.eta;
    eta[k] += step;
    const Columns above = GatherColumns(*term.candidate, w.evidence, eta);
    eta[k] -= 2 * step;
    const Columns below = GatherColumns(*term.candidate, w.evidence, eta);
    Columns out{above.joints, {}};
    double shows = 0;  // chi^2
    for (std::size_t r = 0; r < above.joints.size(); ++r) {
      out.block.emplace_back((above.block[r] - below.block[r]) * held / (2 * step));
      shows += (step * out.block[r] / w.estimate.sigma[above.joints[r]]).squaredNorm();
    }
    const double wider = kWider * step;
    if (shows > 1 || share * kWider > kWidest || term.eta[k] - wider < unknown.lower ||
        term.eta[k] + wider > unknown.upper)
      return out;
  }
}

// Columns of the terms' own unknowns, one after the other, side by side over all joints.
Columns Slopes(const std::vector<std::pair<const Chosen*, std::size_t>>& unknowns,
               const std::vector<const Chosen*>& terms, const Diagnosis::Work& w) {
  Columns all;
  for (int j = 0; j < w.model.joints() && !unknowns.empty(); ++j) {
    all.joints.push_back(j);
    all.block.emplace_back(MatrixXd::Zero(w.evidence.index[j].size(), static_cast<Eigen::Index>(unknowns.size())));
  }
  for (std::size_t u = 0; u < unknowns.size(); ++u) {
    const auto& [term, k] = unknowns[u];
    const auto t = static_cast<std::size_t>(std::find(terms.begin(), terms.end(), term) - terms.begin());
    const Columns own = Slope(*term, w.estimate.amplitude[t], k, w);
    for (std::size_t r = 0; r < own.joints.size(); ++r)
      all.block[static_cast<std::size_t>(own.joints[r])].col(static_cast<Eigen::Index>(u)) = own.block[r];
  }
  return all;
}

// How well all joints are fitted: -2 log likelihood of white noise.
double Deviance(const Diagnosis::Work& w) {
  double sum = 0;
  for (int j = 0; j < w.model.joints(); ++j) sum += 2 * w.evidence.index[j].size() * std::log(w.estimate.sigma[j]);
  return sum;
}

// The term's unknowns that are estimated: a curve's are not, and those on a bound are held there.
std::vector<std::size_t> Free(const Chosen& term) {
  std::vector<std::size_t> out;
  const auto& all = term.candidate->unknowns();
  for (std::size_t k = 0; k < term.eta.size() && !term.candidate->is_curve(); ++k)
    if (!IsAtEdge(all[k % all.size()], term.delay_s != 0 ? term.delay_s : term.eta[k])) out.push_back(k);
  return out;
}

// A curve over all that the term reads takes up what the term's unknowns change: beside it they would run to a bound.
bool IsBesideItsCurve(const Chosen& term, const std::vector<const Chosen*>& terms) {
  return std::any_of(terms.begin(), terms.end(), [&](const Chosen* other) {
    return other->candidate->is_curve() && SharesJoint(*other->candidate, *term.candidate) &&
           other->candidate->ReadsAllOf(*term.candidate);
  });
}

}  // namespace

void Diagnosis::Work::Polish() {
  constexpr int kSteps = 8;
  constexpr double kWorthIt = 1;     // gain of a step
  constexpr double kLongest = 0.25;  // of an unknown's size, in one step
  const std::vector<const Chosen*> terms = Confirmed(chosen);
  std::vector<std::pair<const Chosen*, std::size_t>> unknowns;
  std::vector<double*> value;
  for (Chosen& c : chosen) {
    const codegen::SearchWay how = c.candidate->record().search.how;
    if (!c.confirmed || c.candidate->is_curve() || IsBesideItsCurve(c, terms) ||
        (how != codegen::SearchWay::kProfile && how != codegen::SearchWay::kSpectral))
      continue;
    for (std::size_t k = 0; k < c.eta.size(); ++k) {
      unknowns.emplace_back(&c, k);
      value.push_back(c.delay_s != 0 ? &c.delay_s : &c.eta[k]);
    }
  }
  const auto solve = [&] {
    AlignLogs();
    Solve(terms);
  };
  solve();
  for (int step = 0; step < kSteps && !unknowns.empty(); ++step) {
    Prepare(terms);
    const Gain gain = Metric(rows, WhiteNoise()).Try(Slopes(unknowns, terms, *this));
    if (gain.gain < kWorthIt) return;
    const double before = Deviance(*this);
    std::vector<double> old;
    for (std::size_t u = 0; u < unknowns.size(); ++u) {
      const auto& all = unknowns[u].first->candidate->unknowns();
      const auto& limits = all[unknowns[u].second % all.size()];
      double& x = *value[u];
      old.push_back(x);
      const double longest = kLongest * std::abs(x);
      x += std::clamp(gain.amplitude[static_cast<Eigen::Index>(u)], -longest, longest);
      x = std::clamp(x, limits.lower, limits.upper);
    }
    solve();
    if (Deviance(*this) < before) continue;
    for (std::size_t u = 0; u < unknowns.size(); ++u) *value[u] = old[u];
    solve();
    return;
  }
}

std::vector<Diagnosis::Work::Deviation> Diagnosis::Work::Deviations(const std::vector<const Chosen*>& terms) {
  Prepare(terms);
  const Metric metric(rows, WhiteNoise());
  std::vector<std::pair<const Chosen*, std::size_t>> unknowns;
  for (const Chosen* t : terms)
    for (const std::size_t k : Free(*t)) unknowns.emplace_back(t, k);
  const Columns all = Slopes(unknowns, terms, *this);
  std::vector<const VectorXd*> time;
  for (const auto* log : train) time.push_back(&log->s.t);
  const MatrixXd P = metric.RobustCovariance(all, kBlock_s, time);
  const int d = rows.coordinates();
  const Eigen::Index unknown = P.rows() - d, coordinates = rows.L.rows();
  MatrixXd map = MatrixXd::Zero(coordinates + unknown, P.rows());  // from z and the unknowns to x and the unknowns
  map.topLeftCorner(coordinates, d) = rows.L, map.bottomRightCorner(unknown, unknown).setIdentity();
  const MatrixXd all_covariance = map * P * map.transpose();
  const VectorXd sd = all_covariance.diagonal().cwiseMax(0).cwiseSqrt();
  std::vector<Deviation> out;
  int at = static_cast<int>(declared.active.size()), slope = 0;
  for (const Chosen* t : terms) {
    const int columns = t->candidate->columns(t->eta), count = static_cast<int>(t->eta.size());
    out.push_back({sd.segment(at, columns), VectorXd::Zero(count), MatrixXd::Zero(count + columns, count + columns)});
    std::vector<Eigen::Index> from, to;
    for (const std::size_t k : Free(*t)) {
      out.back().eta[static_cast<Eigen::Index>(k)] = sd[coordinates + slope];
      from.push_back(coordinates + slope++), to.push_back(static_cast<Eigen::Index>(k));
    }
    for (int c = 0; c < columns; ++c) from.push_back(at + c), to.push_back(count + c);
    out.back().covariance(to, to) = all_covariance(from, from);
    at += columns;
  }
  return out;
}

}  // namespace armcal::diagnosis
