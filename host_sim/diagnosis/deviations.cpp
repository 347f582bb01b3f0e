// diagnosis - how sure the terms' parameters are.
#include <algorithm>
#include <cmath>

#include "host_sim/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kStep = 1e-3;    // of an unknown's range or size, for the slope of its columns
constexpr double kBlock_s = 0.5;  // over which noise may hang together

// What the term's torque changes by per unit of its unknown number k.
Columns Slope(const Chosen& term, const VectorXd& amplitude, std::size_t k, const Evidence& evidence) {
  const auto& unknown = term.candidate->unknowns()[k % term.candidate->unknowns().size()];
  const double step = kStep * std::min(unknown.upper - unknown.lower,
                                       unknown.logarithmic ? std::abs(term.eta[k]) : unknown.upper - unknown.lower);
  VectorXd held = amplitude;  // of a delay that has been applied the column is zero, and so is its estimate
  for (int c = 0; c < held.size(); ++c)
    if (term.candidate->column(c).fixed_amplitude) held[c] = term.candidate->column(c).amplitude;
  std::vector<double> eta = term.eta;
  eta[k] += step;
  const Columns above = GatherColumns(*term.candidate, evidence, eta);
  eta[k] -= 2 * step;
  const Columns below = GatherColumns(*term.candidate, evidence, eta);
  Columns out{above.joints, {}};
  for (std::size_t r = 0; r < above.joints.size(); ++r)
    out.block.emplace_back((above.block[r] - below.block[r]) * held / (2 * step));
  return out;
}

}  // namespace

std::vector<Diagnosis::Work::Deviation> Diagnosis::Work::Deviations(const std::vector<const Chosen*>& terms) {
  Prepare(terms);
  const Metric metric(rows, WhiteNoise());
  std::vector<Columns> slopes;
  for (std::size_t t = 0; t < terms.size(); ++t)
    for (std::size_t k = 0; k < terms[t]->eta.size() && !terms[t]->candidate->is_curve(); ++k)
      slopes.push_back(Slope(*terms[t], estimate.amplitude[t], k, evidence));
  Columns all;
  for (int j = 0; j < model.joints() && !slopes.empty(); ++j) {
    all.joints.push_back(j);
    all.block.emplace_back(MatrixXd::Zero(evidence.index[j].size(), static_cast<Eigen::Index>(slopes.size())));
    for (std::size_t k = 0; k < slopes.size(); ++k)
      for (std::size_t r = 0; r < slopes[k].joints.size(); ++r)
        if (slopes[k].joints[r] == j) all.block.back().col(static_cast<Eigen::Index>(k)) = slopes[k].block[r];
  }
  std::vector<const VectorXd*> time;
  for (const auto* log : train) time.push_back(&log->s.t);
  const MatrixXd P = metric.RobustCovariance(all, kBlock_s, time);
  const int d = rows.coordinates();
  const VectorXd x_sd = (rows.L * P.topLeftCorner(d, d) * rows.L.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd eta_sd = P.diagonal().tail(P.rows() - d).cwiseMax(0).cwiseSqrt();
  std::vector<Deviation> out;
  int at = static_cast<int>(declared.active.size()), slope = 0;
  for (const Chosen* t : terms) {
    const int columns = t->candidate->columns(t->eta), count = static_cast<int>(t->eta.size());
    out.push_back({x_sd.segment(at, columns), VectorXd::Zero(count)});
    if (!t->candidate->is_curve()) out.back().eta = eta_sd.segment(slope, count), slope += count;
    at += columns;
  }
  return out;
}

}  // namespace armcal::diagnosis
