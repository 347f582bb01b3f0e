// survey - Table 10: what noise in the position does, without a control loop and in the closed loop.

#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/prefilter.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
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
  const Truth truth =
      AnalyticTruth(codegen::Model(arm, settings.records), Sampled(motions.linear.series), Sampled(motions.other));
  std::vector<std::vector<Cells>> of_draw(static_cast<std::size_t>(draws));
  ForEachDraw(settings, "table 10, tier 2", draws, [&](int d) {
    std::vector<Cells>& cells = of_draw[static_cast<std::size_t>(d)];
    cells.resize(std::size(kNoise_rad) * std::size(kDerivatives));
    const auto seed = settings.seed * 653 + 4 * static_cast<std::uint64_t>(d);
    const PriorError error;
    const codegen::Model prior(DrawPrior(arm, error, seed), settings.records);
    const Eigen::MatrixXd tau = truth.train.tau + Noise(truth.train.samples(), truth.sigma_Nm, seed + 1);
    for (std::size_t n = 0; n < std::size(kNoise_rad); ++n) {
      const codegen::Signals noisy = Differentiated(truth.train.s, kNoise_rad[n], seed + 2);
      const calibration::Dataset plain = Measured(noisy, tau);
      const calibration::Dataset logs[] = {plain, Measured(Filtered(noisy.t, noisy.q), tau),
                                           calibration::FourierFit(prior, plain, motions.linear.series.period_s)};
      for (std::size_t s = 0; s < std::size(kDerivatives); ++s)
        for (std::size_t m = 0; m < std::size(kMethods); ++m) {
          calibration::Problem p = WithPrior(prior, {&logs[s]}, RelativeDeviation(error));
          if (m == 0) p.covariance.resize(0, 0);
          const Attempt attempt = Try(calibration::FindMethod(kMethods[m]), p);
          if (!attempt.solution || !attempt.solution->z.allFinite()) continue;
          const Score score = Judge(truth, settings.levels, tau, *attempt.solution, calibration::BodyMean(prior));
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

namespace {

constexpr double kPositionNoise_rad = 1e-4;
constexpr int kLoopDraws = 20;

struct Contender {
  const char* method;
  bool prior;
};
const Contender kContenders[] = {
    {"pseudo_inverse", false}, {"instrumental_variable", false}, {"map_barrier", true},          {"robust", true},
    {"didim", true},           {"parallel_decimation", true},    {"instrumental_variable", true}};

// The signals that a method gets: q through the 20 Hz filter, as read, or as a Fourier series of its period.
enum Signal { kFiltered, kPlain, kFourier, kSignals };

struct Result {
  std::vector<Score> score[kSignals];
  std::vector<double> growth;
  std::string why;
};

// One draw: its logs, and the model that a method may use.
struct Draw {
  codegen::Model prior;
  calibration::Dataset log[kSignals];
};

class Bench {
 public:
  Bench(const Settings& settings, const Motions& motions)
      : settings_(settings),
        arm_(Variant(settings.robot, Law::kCoulombViscous, Bodies::kStandard, SetStribeck(settings.robot.joints()))),
        wanted_(Sampled(motions.linear.series)),
        period_s_(motions.linear.series.period_s) {
    codegen::Model model(arm_, settings.records);
    const VectorXd z = SetParameters(model);
    feedforward_ = settings.cad_feedforward
                       ? SetParameters(codegen::Model(DrawPrior(arm_, error_, settings.seed), settings.records))
                       : z;
    calibration::LoopSimulator loop(model, {feedforward_, true});
    run_ = loop.Run(wanted_.t, wanted_.q, z);
    truth_ = std::make_unique<Truth>(AnalyticTruth(std::move(model), run_.s, Sampled(motions.other)));
  }

  Draw At(int d) const {
    const auto seed = settings_.seed * 499 + 4 * static_cast<std::uint64_t>(d);
    const MatrixXd noise = Noise(run_.s.samples(), VectorXd::Constant(arm_.joints(), kPositionNoise_rad), seed + 1);
    const MatrixXd q = run_.q_read + noise, tau = run_.tau + Noise(run_.s.samples(), truth_->sigma_Nm, seed + 2);
    Draw draw{codegen::Model(DrawPrior(arm_, error_, seed), settings_.records), {}};
    draw.log[kFiltered] = Measured(Filtered(wanted_.t, q), tau);
    draw.log[kPlain] = Measured(Differentiated(wanted_.t, q), tau);
    for (calibration::Dataset& log : draw.log) log.source = "closed loop", log.reference = wanted_.q;
    draw.log[kFourier] = calibration::FourierFit(draw.prior, draw.log[kPlain], period_s_);
    return draw;
  }

  std::optional<Score> Solve(const Draw& draw, Signal signal, const Contender& c, std::string& why) const {
    const calibration::Dataset& log = draw.log[signal];
    calibration::Problem p = WithPrior(draw.prior, {&log}, RelativeDeviation(error_));
    if (!c.prior) p.covariance.resize(0, 0);
    p.closed_loop = calibration::MakeClosedLoop(draw.prior, {feedforward_, false});
    p.stop = settings_.stop;
    Attempt attempt = Try(calibration::FindMethod(c.method), p);
    if (!attempt.solution) why = attempt.why;
    else if (!attempt.solution->remark.empty() && signal == kPlain) why = attempt.solution->remark;
    if (!attempt.solution || !attempt.solution->z.allFinite()) return std::nullopt;
    return Judge(*truth_, settings_.levels, log.tau, *attempt.solution, calibration::BodyMean(draw.prior));
  }

 private:
  const Settings& settings_;
  codegen::Robot arm_;
  codegen::Signals wanted_;
  double period_s_;
  PriorError error_;
  VectorXd feedforward_;  // the parameters of the loop's controller
  calibration::LoopRun run_;
  std::unique_ptr<Truth> truth_;
};

std::vector<Cell> RowOf(const Settings& settings, const Contender& c, const Result& r) {
  const auto printed = [&](std::size_t place) {
    return c.prior ? Cell("-") : Cell(settings.printed.At("table10", c.method, place));
  };
  const std::vector<Score>&plain = r.score[kPlain], &fourier = r.score[kFourier];
  return {calibration::FindMethod(c.method).title,
          c.prior ? "CAD, uniform +-20 %" : "none",
          Mean(r.score[kFiltered], &Score::J_e),
          printed(0),
          Mean(plain, &Score::J_e),
          printed(1),
          Mean(r.growth),
          printed(2),
          Mean(fourier, &Score::J_e),
          Mean(plain, &Score::e_d_over_prior),
          Mean(r.score[kFiltered], &Score::e_base),
          Mean(plain, &Score::e_base),
          Mean(fourier, &Score::e_base),
          static_cast<double>(plain.size()),
          r.why.empty() ? "-" : r.why};
}

}  // namespace

void ShowInstruments(const Settings& settings, const Motions& motions, Findings& out) {
  if (!settings.Wants("10")) return;
  Sheet sheet{
      "10",
      "noise in q: instruments (17) against the pseudo-inverse (15), model (7)",
      {"method", "prior", "J_e filter", "J_e filter printed", "J_e no filter", "J_e no filter printed", "Delta J_e",
       "Delta J_e printed", "J_e Fourier fit", "e_d / e_d(prior) no filter", "base error / sigma filter",
       "base error no filter", "base error Fourier fit", "draws", "remark"},
      {},
      {std::string(
           "Tier 3: the arm runs under its robot file's 1 kHz control law with an encoder; its feed-forward uses ") +
           (settings.cad_feedforward ? "CAD values, uniform +-20 % off"
                                     : "the set parameters, as in the survey's Figure 3") +
           ". q is read at 100 Hz with 1e-4 rad of noise, differentiated "
           "centrally, with and without the 20 Hz fourth-order Butterworth filter; torque noise of Table 7. Fourier "
           "fit: q "
           "as a series of 15 harmonics of the period, its derivatives exact.",
       "Instruments come from a simulation of each method's own estimate under the same law, never of the truth. An "
       "estimate without a prior may have no possible arm (joint 6 has 0.003 kg m^2, less than its standard "
       "deviation); "
       "then the simulation goes back towards the CAD values until the arm follows.",
       "Without a prior J_e is e_d of the standard parameters' smallest answer, a ratio by chance; what noise does and "
       "instruments undo is seen in the base error."}};
  const Bench bench(settings, motions);
  const int draws = std::min(kLoopDraws, settings.draws);
  std::vector<std::vector<Result>> of_draw(static_cast<std::size_t>(draws));
  ForEachDraw(settings, "table 10", draws, [&](int d) {
    const Draw draw = bench.At(d);
    for (const Contender& c : kContenders) {
      Result r;
      for (const Signal signal : {kFiltered, kPlain, kFourier})
        if (const auto score = bench.Solve(draw, signal, c, r.why)) r.score[signal].push_back(*score);
      of_draw[static_cast<std::size_t>(d)].push_back(std::move(r));
    }
  });
  for (std::size_t k = 0; k < std::size(kContenders); ++k) {
    Result all;
    for (const std::vector<Result>& results : of_draw) {
      if (results.empty()) continue;
      const Result& r = results[k];
      for (const Signal signal : {kFiltered, kPlain, kFourier})
        all.score[signal].insert(all.score[signal].end(), r.score[signal].begin(), r.score[signal].end());
      if (!r.score[kFiltered].empty() && !r.score[kPlain].empty())
        all.growth.push_back(r.score[kPlain][0].J_e / r.score[kFiltered][0].J_e - 1);
      if (all.why.empty()) all.why = r.why;
    }
    sheet.rows.push_back(RowOf(settings, kContenders[k], all));
    if (!kContenders[k].prior || std::string(kContenders[k].method) != "instrumental_variable" ||
        all.score[kPlain].empty())
      continue;
    out.goals.push_back(
        {"Table 10, regularised IV, no filter: mean J_e", Over(all.score[kPlain], &Score::J_e).mean, 0.2, true});
  }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
