// survey - searches the trajectories, and makes samples, noise and differences.
#include "host_sim/study/survey/platform.hpp"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

codegen::Signals Sampled(const excitation::Series& series, int samples) {
  return series.At(VectorXd::LinSpaced(samples, 0, (samples - 1) / kRate_Hz));
}

MatrixXd Noise(int samples, const VectorXd& sigma, std::uint64_t seed) {
  plant::Random random(seed);
  MatrixXd noise(samples, sigma.size());
  for (Eigen::Index k = 0; k < noise.rows(); ++k)
    for (Eigen::Index j = 0; j < noise.cols(); ++j) noise(k, j) = sigma[j] * random.Normal();
  return noise;
}

calibration::Dataset Measured(const codegen::Signals& s, const MatrixXd& tau) {
  calibration::Dataset d;
  d.s = s;
  d.tau = tau;
  d.moving = d.used = Eigen::MatrixXi::Ones(tau.rows(), tau.cols());
  d.scored = Eigen::VectorXi::Ones(tau.rows());
  d.cutoff_Hz = VectorXd::Zero(tau.cols());
  d.source = "survey platform";
  return d;
}

codegen::Signals Differentiated(const VectorXd& t, const MatrixXd& q) {
  codegen::Signals s;
  s.t = t;
  s.q = q;
  const double h = t[1] - t[0];
  const Eigen::Index n = q.rows();
  s.qd.resize(n, q.cols()), s.qdd.resize(n, q.cols());
  const auto inner = n - 2;
  s.qd.middleRows(1, inner) = (q.bottomRows(inner) - q.topRows(inner)) / (2 * h);
  s.qdd.middleRows(1, inner) = (q.bottomRows(inner) - 2 * q.middleRows(1, inner) + q.topRows(inner)) / (h * h);
  s.qd.row(0) = (q.row(1) - q.row(0)) / h, s.qd.row(n - 1) = (q.row(n - 1) - q.row(n - 2)) / h;
  s.qdd.row(0) = s.qdd.row(1), s.qdd.row(n - 1) = s.qdd.row(n - 2);
  return s;
}

codegen::Signals Differentiated(const codegen::Signals& s, double noise_rad, std::uint64_t seed) {
  return Differentiated(s.t, s.q + Noise(s.samples(), VectorXd::Constant(s.q.cols(), noise_rad), seed));
}

codegen::Signals Filtered(const VectorXd& t, const MatrixXd& q, double cutoff_Hz) {
  MatrixXd smooth = q;
  for (Eigen::Index j = 0; j < q.cols(); ++j)
    smooth.col(j) = logs::ZeroPhaseLowPass(q.col(j), cutoff_Hz, 1 / (t[1] - t[0]));
  return Differentiated(t, smooth);
}

namespace {

constexpr int kStarts = 60, kStartsNonlinear = 12;  // about 10 s each on two cores

double Condition(const Eigen::MatrixXd& gram) {
  const Eigen::VectorXd value =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues();
  return std::sqrt(value[value.size() - 1] / value[0]);
}

codegen::Model ModelOf(const codegen::Robot& file, const codegen::Catalogue& records, Law law) {
  return {Variant(file, law, Bodies::kBase, SetStribeck(file.joints())), records};
}

excitation::Criterion AboutFriction(const excitation::Observation& observation) {
  excitation::Criterion criterion{excitation::Criterion::Kind::kAccuracy};
  for (std::size_t k = 0; k < observation.columns().size(); ++k)
    if (!observation.model().is_rigid(observation.columns()[k])) criterion.about.push_back(static_cast<int>(k));
  return criterion;
}

// The limits are those of the arm itself and do not depend on K. So the torque is that of (7) with the set parameters.
double LimitShare(const codegen::Robot& file, const codegen::Catalogue& records, const excitation::Series& series) {
  const codegen::Model model = ModelOf(file, records, Law::kCoulombViscous);
  const excitation::Observation observation(model);
  const auto points = static_cast<Eigen::Index>(std::ceil(series.period_s / excitation::kCheckStep_s));
  const Eigen::VectorXd t =
      Eigen::VectorXd::LinSpaced(points, 0, excitation::kCheckStep_s * static_cast<double>(points - 1));
  return excitation::LargestShare(excitation::FindPeaks(observation, series.At(t)));
}

}  // namespace

void Examine(const codegen::Robot& file, const codegen::Catalogue& records, ExcitedBy& e) {
  const codegen::Model model = ModelOf(file, records, e.law);
  const excitation::Observation observation(model);
  e.columns = static_cast<int>(observation.columns().size());
  const Eigen::MatrixXd gram = excitation::PeriodGram(observation, e.series);
  e.condition = excitation::Figure({}, gram);
  e.raw = Condition(gram);
  e.all_sd = excitation::Figure({excitation::Criterion::Kind::kDOptimal}, gram);
  e.friction_sd = excitation::Figure(AboutFriction(observation), gram);
  std::vector<Eigen::MatrixXd> row;
  observation.Rows(Sampled(e.series), row);
  for (int j = 0; j < model.joints(); ++j) row[j] *= 1 / std::sqrt(observation.weight(j));
  const Eigen::MatrixXd unweighted = observation.Gram(row, row[0].rows());
  e.unweighted = excitation::Figure({}, unweighted);
  e.plain = Condition(unweighted);
  e.share = LimitShare(file, records, e.series);
}

void Excite(const codegen::Robot& file, const codegen::Catalogue& records, const SearchSettings& settings,
            ExcitedBy& e) {
  const auto begin = std::chrono::steady_clock::now();
  const codegen::Model model = ModelOf(file, records, e.law);
  const excitation::Observation observation(model);
  excitation::OptimiseSettings s;
  s.shape.family = e.family;
  // The columns of (4) differ from zero only where a joint is slow. 80 samples a period would miss most of that.
  s.shape.samples = e.law == Law::kGradient ? 250 : 80;
  s.criterion.kind = e.criterion;
  if (e.criterion == excitation::Criterion::Kind::kAccuracy) s.criterion = AboutFriction(observation);
  s.search = e.search;
  s.margin = 0.02;
  s.seconds = settings.seconds;
  if (e.search == excitation::Search::kGenetic) s.starts = 2;
  else s.starts = e.law == Law::kGradient ? kStartsNonlinear : kStarts;
  if (settings.starts > 0) s.starts = std::min(s.starts, settings.starts);
  s.seed = settings.seed;
  s.stop = settings.stop;
  const excitation::Optimum best = excitation::Optimise(observation, s);
  e.series = best.series;
  e.searches = best.starts;
  e.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Examine(file, records, e);
}

excitation::Series Validation(const codegen::Robot& file, const codegen::Catalogue& records, std::uint64_t seed) {
  const codegen::Model model = ModelOf(file, records, Law::kCoulombViscous);
  const excitation::Observation observation(model);
  excitation::Series series;
  constexpr std::uint64_t kTries = 100;
  for (std::uint64_t k = 0; k < kTries; ++k)
    if (excitation::RandomSeries(observation, {}, seed * kTries + k, series)) return series;
  throw io::InputError(file.path + ": no random motion within the joints' limits was found");
}

}  // namespace armcal::survey
