// survey - calls the search and describes what it found.
#include "host_sim/survey/trajectories.hpp"

#include <Eigen/Eigenvalues>
#include <chrono>
#include <cmath>

#include "host_sim/excitation/optimise.hpp"
#include "host_sim/excitation/peaks.hpp"
#include "host_sim/io/input_error.hpp"
#include "host_sim/survey/platform.hpp"

namespace armcal::survey {
namespace {

double Condition(const Eigen::MatrixXd& gram) {
  const Eigen::VectorXd value =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues();
  return std::sqrt(value[value.size() - 1] / value[0]);
}

codegen::Model ModelOf(const codegen::Robot& file, const codegen::Catalogue& records, Law law) {
  return {Variant(file, law, Bodies::kBase, SetStribeck(file.joints())), records};
}

// Limits belong to the arm as it is, whatever K is looked at: torque by the set parameters of (7).
double LimitShare(const codegen::Robot& file, const codegen::Catalogue& records, const excitation::Fourier& series) {
  const codegen::Model model = ModelOf(file, records, Law::kCoulombViscous);
  const excitation::Observation observation(model);
  const auto points = static_cast<Eigen::Index>(std::ceil(series.period_s() / excitation::kCheckStep_s));
  const Eigen::VectorXd t =
      Eigen::VectorXd::LinSpaced(points, 0, excitation::kCheckStep_s * static_cast<double>(points - 1));
  return excitation::LargestShare(excitation::FindPeaks(observation, series.At(t)));
}

}  // namespace

ExcitedBy Examine(const codegen::Robot& file, const codegen::Catalogue& records, Law law,
                  const excitation::Fourier& series) {
  const codegen::Model model = ModelOf(file, records, law);
  const excitation::Observation observation(model);
  ExcitedBy out;
  out.series = series;
  out.law = LawName(law);
  out.columns = static_cast<int>(observation.columns().size());
  out.condition = excitation::PeriodCondition(observation, series);
  std::vector<Eigen::MatrixXd> row;
  observation.Rows(Sampled(series), row);
  out.raw = Condition(observation.Gram(row, row[0].rows()));
  for (int j = 0; j < model.joints(); ++j) row[j] *= 1 / std::sqrt(observation.weight(j));
  out.unweighted = Condition(excitation::Equilibrated(observation.Gram(row, row[0].rows())));
  out.share = LimitShare(file, records, series);
  return out;
}

ExcitedBy Excite(const codegen::Robot& file, const codegen::Catalogue& records, Law law,
                 const SearchSettings& settings) {
  const auto begin = std::chrono::steady_clock::now();
  const codegen::Model model = ModelOf(file, records, law);
  const excitation::Observation observation(model);
  excitation::OptimiseSettings s;
  // The columns of (4) live where a joint is slow: 80 samples a period would miss most of them.
  s.shape.samples = law == Law::kGradient ? 250 : 80;
  s.margin = 0.02;
  s.seconds = settings.seconds;
  s.seed = settings.seed;
  s.stop = settings.stop;
  const excitation::Optimum best = excitation::Optimise(observation, s);
  ExcitedBy out = Examine(file, records, law, best.series);
  out.searches = best.starts;
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

excitation::Fourier Validation(const codegen::Robot& file, const codegen::Catalogue& records, std::uint64_t seed) {
  const codegen::Model model = ModelOf(file, records, Law::kCoulombViscous);
  const excitation::Observation observation(model);
  excitation::Fourier series;
  constexpr std::uint64_t kTries = 100;
  for (std::uint64_t k = 0; k < kTries; ++k)
    if (excitation::RandomSeries(observation, {}, seed * kTries + k, series)) return series;
  throw io::InputError(file.path + ": no random motion within the joints' limits was found");
}

}  // namespace armcal::survey
