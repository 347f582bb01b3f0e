// diagnosis - compares the likelihood of a log with and without a term, predicted or fitted.
#include "host_sim/diagnose/diagnosis/gain_on_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kKnock = 4;  // deviations: what is larger is no noise

// Of a term, with white and with coloured noise.
struct Gains {
  double white = 0, coloured = 0;
};

// The term's gain over the declared model and the other terms, all fitted to the logs of `fit`. noise: of each joint;
// empty: it becomes what these logs show.
Gains FittedTo(Diagnosis::Work& fit, const Diagnosis::Work& w, const Chosen& term,
               const std::vector<const Chosen*>& others, std::vector<NoiseModel>& noise) {
  fit.PrepareAsIn(w, others, *term.candidate);
  const Columns columns = GatherColumns(*term.candidate, fit.evidence, term.eta);
  const Metric white(fit.rows, w.WhiteNoise());
  if (noise.empty()) (void)white.RefittedDeviance(columns, &noise);
  return {white.Try(columns).gain, Metric(fit.rows, noise).Try(columns).gain};
}

}  // namespace

double GainOn(const calibration::Dataset& log, const Candidate& candidate, const MatrixXd& without,
              const MatrixXd& with) {
  std::array<double, 4> sum{};
  for (const int j : candidate.rows()) {
    const RowIndex rows = UsedRows({&log}, j);
    VectorXd before(rows.size()), after(rows.size());
    rows.Take(0, without.col(j), before), rows.Take(0, with.col(j), after);
    const double most = kKnock * UsualDeviation(before);
    const auto add = [&](std::size_t at, const VectorXd& of, const VectorXd& to) {
      const auto gain = [&](double a, double b) { return b > 0 ? rows.size() * std::log(a / b) : 0; };
      const NoiseModel noise = FitNoise(rows, to);
      sum[at] += gain(of.squaredNorm(), to.squaredNorm());
      sum[at + 1] += gain(Whiten(noise, rows, of).squaredNorm(), Whiten(noise, rows, to).squaredNorm());
    };
    add(0, before, after);
    add(2, before.cwiseMax(-most).cwiseMin(most), after.cwiseMax(-most).cwiseMin(most));
  }
  return *std::max_element(sum.begin(), sum.end());
}

double AddedBy(Diagnosis::Work& w, const calibration::Dataset& log, const Chosen& term,
               const std::vector<const Chosen*>& others) {
  std::vector<NoiseModel> noise;
  const Gains trained = FittedTo(w, w, term, others, noise);
  std::vector<const calibration::Dataset*> logs = w.train;
  logs.push_back(&log);
  Diagnosis::Work both(w, logs);
  const Gains with_log = FittedTo(both, w, term, others, noise);
  return std::max(with_log.white - trained.white, with_log.coloured - trained.coloured);
}

}  // namespace armcal::diagnosis
