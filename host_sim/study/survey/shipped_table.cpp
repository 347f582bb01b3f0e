// survey - how far the prior of the robot file as it ships leads from the CAD values to the truth: logs of the plant,
// CAD values off in ways that the estimate is not told.
#include <array>
#include <cmath>

#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/identify/methods/link_widths.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/plant_run.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

using Eigen::VectorXd;

constexpr int kRuns = 20;             // of the plant at most; further draws of CAD values use the same runs again
constexpr double kRecord_s = 30;      // of each run
constexpr double kLinksUnknown = 30;  // relative width of the links that is as good as no prior

struct Row {
  CadError error;
  double goal;  // of mean e_d over that of the CAD values
};

// One draw: e_d over the CAD values' with the estimated widths and with the file's; RMS of the torque left in the
// held-out run in units of the fit's residual, with estimated widths and without a prior of the links.
struct Reached {
  double cad = NAN, estimated = NAN, as_filed = NAN, held = NAN, held_free = NAN;
  bool physical = false;
  calibration::LinkWidths widths;
};

double Left(const codegen::Model& model, const calibration::Dataset& log, const VectorXd& x, const VectorXd& sigma) {
  const VectorXd rms = calibration::RmsInBand(log, log.tau - calibration::Predict(model, log, x, {}));
  return std::sqrt(rms.cwiseQuotient(sigma).squaredNorm() / static_cast<double>(sigma.size()));
}

Reached Reach(const Settings& settings, const CadError& error, std::uint64_t seed, const logs::Log& train,
              const logs::Log& test) {
  const codegen::Robot cad = DrawCad(settings.robot, error, seed);
  const codegen::Model model(cad, settings.records);
  const calibration::Dataset log = calibration::Prepare(model, train), held = calibration::Prepare(model, test);
  const calibration::Fit fit = calibration::WeightedFit(model, {&log});
  Reached out;
  out.widths = calibration::EstimateLinkWidths(model, fit);
  const calibration::PhysicalReadOut found = calibration::ReadOutWithWidths(model, fit, out.widths);
  const auto e_d = [&](const VectorXd& bodies) {
    return error.has_absolute() ? ScaledBodyError(settings.robot, bodies)
                                : CompareBodies(BodiesOf(settings.robot), bodies, settings.levels).e_d;
  };
  out.cad = e_d(calibration::BodyMean(model));
  out.estimated = e_d(found.bodies) / out.cad;
  out.as_filed = e_d(calibration::ReadOutPhysical(model, fit).bodies) / out.cad;
  out.physical = calibration::IsPhysical(found.bodies);
  codegen::Robot free = cad;
  free.link_relative_sd = kLinksUnknown;
  const codegen::Model unknown(free, settings.records);
  out.held = Left(model, held, found.x, fit.sigma);
  out.held_free = Left(model, held, calibration::WeightedFit(unknown, {&log}).x, fit.sigma);
  return out;
}

std::vector<double> All(const std::vector<Reached>& reached, double Reached::*value) {
  std::vector<double> out;
  for (const Reached& r : reached) out.push_back(r.*value);
  return out;
}

}  // namespace

void ShowShippedPrior(const Settings& settings, const Motions& motions, Findings& out) {
  Sheet sheet{
      "shipped prior",
      "MAP with the robot file's own prior, logs of the plant",
      {"CAD values", "draws", "e_d(CAD)", "e_d / e_d(CAD)", "same with the file's widths", "share better",
       "torque left / sigma", "torque left, no prior", "share physical", "w", "a / mm", "r"},
      {},
      {"The plant is the truth (Orocos KDL, stiction, quantised sensors, a loop of its own); its bodies are the "
       "file's, its friction and torque constants are drawn. The CAD values are off, and the estimate is not "
       "told how: widths w, a, r are read from the log (armcal identify does the same).",
       "Errors that are added (10 mm, 5 % of the trace of the inertia) are measured by mass, link length and "
       "trace, and entries that are truly 0 count; else e_d is that of section 5.",
       "Widths of 20 % without floors, as the error is drawn, reach 0.80 to 0.88 (uniform, 20 %) from 10 s and 0.78 "
       "from 40 s."}};
  using Kind = CadError::Kind;
  const std::array<Row, 7> rows{{{{Kind::kWorst, 0.2}, 0.85},
                                 {{Kind::kUniform, 0.2}, 0.85},
                                 {{Kind::kAdded, 0}, 0.95},
                                 {{Kind::kOneLink, 0.05}, 0.95},
                                 {{Kind::kMixed, 0.2}, 0.95},
                                 {{Kind::kUniform, 0.05}, 1},
                                 {{Kind::kUniform, 0.5}, 1}}};
  const int runs = std::min(settings.draws, kRuns);
  std::vector<logs::Log> train(static_cast<std::size_t>(runs)), test = train;
  ForEachDraw(settings, "runs of the plant", runs, [&](int d) {
    PlantSettings s;
    s.truth_seed = settings.seed * 1009 + static_cast<std::uint64_t>(d), s.noise_seed = 2 * s.truth_seed;
    s.seconds = kRecord_s;
    train[static_cast<std::size_t>(d)] = RunPlant(settings.robot, motions.linear.series, s);
    ++s.noise_seed, s.seconds = 10;
    test[static_cast<std::size_t>(d)] = RunPlant(settings.robot, motions.other, s);
  });
  double held = 0, free = 0;
  bool physical = true;
  for (const Row& row : rows) {
    if (settings.Stopped()) return;
    std::vector<Reached> reached(static_cast<std::size_t>(settings.draws));
    ForEachDraw(settings, "shipped prior, " + CadErrorName(row.error), settings.draws, [&](int d) {
      const auto run = static_cast<std::size_t>(d % runs);
      reached[static_cast<std::size_t>(d)] =
          Reach(settings, row.error, settings.seed * 7919 + static_cast<std::uint64_t>(d), train[run], test[run]);
    });
    int better = 0, possible = 0;
    double w = 0, a = 0, r = 0;
    const auto draws = static_cast<double>(reached.size());
    for (const Reached& one : reached) {
      better += one.estimated < 1, possible += one.physical, physical &= one.physical;
      w += one.widths.relative.mean() / draws, a += 1e3 * one.widths.center_m / draws;
      r += one.widths.inertia_of_trace / draws;
    }
    const Statistic ratio = Summarise(All(reached, &Reached::estimated));
    sheet.rows.push_back({CadErrorName(row.error), draws, Mean(All(reached, &Reached::cad)),
                          Cell(ratio.mean, ratio.low, ratio.high), Mean(All(reached, &Reached::as_filed)),
                          better / draws, Mean(All(reached, &Reached::held)), Mean(All(reached, &Reached::held_free)),
                          possible / draws, w, a, r});
    held = std::max(held, Summarise(All(reached, &Reached::held)).mean);
    free = std::max(free, Summarise(All(reached, &Reached::held_free)).mean);
    out.goals.push_back(
        {"Table shipped prior, CAD values off " + CadErrorName(row.error) + ": mean e_d over that of CAD", ratio.mean,
         row.goal, true});
  }
  out.goals.push_back({"Table shipped prior: held-out torque over that without a prior", held / free, 1.02, true});
  out.goals.push_back({"Table shipped prior: every body can exist", physical ? 1.0 : 0.0, 1, false});
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
