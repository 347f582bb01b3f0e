// survey - tier 2 of the platform: what noise in q does to least squares, by how its derivatives are taken.
#include "host_sim/identify/methods/fourier_fit.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

namespace {

constexpr double kNoise_rad[] = {2e-5, 1e-4, 3e-4};
const char* const kDerivatives[] = {"central differences", "20 Hz Butterworth", "Fourier fit"};
constexpr const char* kMethods[] = {"weighted_pseudo_inverse", "map_barrier"};
constexpr int kMostDraws = 20;

struct Cells {
  std::vector<Score> score[std::size(kMethods)];
};

}  // namespace

void ShowDifferentiation(const Settings& settings, const Motions& motions, Findings& out) {
  if (!settings.Wants("10")) return;
  Sheet sheet{"10 tier 2",
              "noise in q without a control loop: how derivatives are taken, model (7)",
              {"noise of q / rad", "derivatives", "least squares: J_e", "least squares: base error / sigma",
               "MAP: e_d / e_d(prior)", "MAP: base error / sigma", "draws"},
              {},
              {"q of the trajectory with white noise at 100 Hz, torque noise of Table 7. Least squares: weighted, no "
               "prior; MAP: CAD prior, uniform +-20 %.",
               "No filter on the torque: a filter on it and not on the columns of sgn(qd) biases friction."}};
  const int draws = std::min(kMostDraws, settings.draws);
  const codegen::Robot arm =
      Variant(settings.robot, Law::kCoulombViscous, Bodies::kStandard, SetStribeck(settings.robot.joints()));
  const std::unique_ptr<Truth> truth =
      MakeTruth(settings, motions, Law::kCoulombViscous, SetStribeck(settings.robot.joints()));
  std::vector<std::vector<Cells>> of_draw(static_cast<std::size_t>(draws));
  ForEachDraw(settings, "table 10, tier 2", draws, [&](int d) {
    std::vector<Cells>& cells = of_draw[static_cast<std::size_t>(d)];
    cells.resize(std::size(kNoise_rad) * std::size(kDerivatives));
    const auto seed = settings.seed * 653 + 4 * static_cast<std::uint64_t>(d);
    const PriorError error;
    const codegen::Model prior(DrawPrior(arm, error, seed), settings.records);
    const Eigen::MatrixXd tau = truth->tau + Noise(truth->train.samples(), truth->sigma_Nm, seed + 1);
    for (std::size_t n = 0; n < std::size(kNoise_rad); ++n) {
      const codegen::Signals noisy = Differentiated(truth->train, kNoise_rad[n], seed + 2);
      const calibration::Dataset plain = Measured(noisy, tau);
      const calibration::Dataset logs[] = {plain, Measured(Filtered(noisy.t, noisy.q), tau),
                                           calibration::FourierFit(prior, plain, motions.linear.series.period_s)};
      for (std::size_t s = 0; s < std::size(kDerivatives); ++s)
        for (std::size_t m = 0; m < std::size(kMethods); ++m) {
          calibration::Problem p = WithPrior(prior, {&logs[s]}, RelativeDeviation(error));
          if (m == 0) p.covariance.resize(0, 0);
          const Attempt attempt = Try(calibration::FindMethod(kMethods[m]), p);
          if (!attempt.solution || !attempt.solution->z.allFinite()) continue;
          const Score score = Judge(*truth, settings.levels, tau, *attempt.solution, calibration::BodyMean(prior));
          cells[n * std::size(kDerivatives) + s].score[m].push_back(score);
        }
    }
  });
  for (std::size_t n = 0; n < std::size(kNoise_rad); ++n)
    for (std::size_t s = 0; s < std::size(kDerivatives); ++s) {
      Cells all;
      for (std::vector<Cells>& cells : of_draw)
        for (std::size_t m = 0; m < std::size(kMethods) && !cells.empty(); ++m) {
          const std::vector<Score>& score = cells[n * std::size(kDerivatives) + s].score[m];
          all.score[m].insert(all.score[m].end(), score.begin(), score.end());
        }
      const auto& [least_squares, map] = all.score;
      sheet.rows.push_back({kNoise_rad[n], kDerivatives[s], Mean(least_squares, &Score::J_e),
                            Mean(least_squares, &Score::e_base), Mean(map, &Score::e_d_over_prior),
                            Mean(map, &Score::e_base), static_cast<double>(map.size())});
    }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
