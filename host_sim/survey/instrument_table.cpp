// survey - Table 10: noise in the position, the pseudo-inverse (15) against instruments (17), in the closed loop.
#include "host_sim/calibration/closed_loop.hpp"
#include "host_sim/survey/platform.hpp"
#include "host_sim/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kPositionNoise_rad = 1e-4;
constexpr int kDraws = 20;
const char* const kLog = "closed loop";

struct Contender {
  std::string method;
  bool prior;
};
const Contender kContenders[] = {
    {"pseudo_inverse", false}, {"instrumental_variable", false}, {"map_barrier", true},          {"robust", true},
    {"didim", true},           {"parallel_decimation", true},    {"instrumental_variable", true}};

struct Result {
  std::vector<Score> filtered, plain;
  std::vector<double> growth;
  std::string why;
};

// The loop's controller knows the set parameters, as in the survey's Figure 3. Methods know the law, not the arm.
calibration::Problem ProblemFor(const codegen::Model& prior, const calibration::Dataset& log, const MatrixXd& reference,
                                const VectorXd& set, const Contender& c, const PriorError& error) {
  calibration::Problem p = WithPrior(prior, {&log}, RelativeDeviation(error));
  if (!c.prior) p.covariance.resize(0, 0);
  p.closed_loop = calibration::MakeClosedLoop(prior, {{kLog, reference}}, {set, false});
  return p;
}

std::optional<Score> Solve(const Settings& settings, const Truth& truth, const codegen::Model& prior,
                           const calibration::Dataset& log, const MatrixXd& reference, const Contender& c,
                           const PriorError& error, const calibration::Method& method, std::string& why) {
  calibration::Problem p = ProblemFor(prior, log, reference, truth.z, c, error);
  p.stop = settings.stop;
  Attempt attempt = Try(method, p);
  if (!attempt.solution || !attempt.solution->z.allFinite()) {
    why = attempt.solution ? attempt.solution->remark : attempt.why;
    return std::nullopt;
  }
  return Judge(truth, settings.levels, log.tau, *attempt.solution, calibration::BodyMean(prior));
}

Cell MeanOf(const std::vector<double>& v) {
  const Statistic s = Summarise(v);
  return {s.mean, s.low, s.high};
}

void Fill(const Settings& settings, const std::vector<Result>& results, Findings& out, Sheet& sheet) {
  for (std::size_t k = 0; k < results.size(); ++k) {
    const Contender& c = kContenders[k];
    const Result& r = results[k];
    const calibration::Method* method = Find(c.method, out.missing);
    if (!method) continue;
    const bool own = !c.prior;
    const auto printed = [&](std::size_t place) {
      return own ? Cell(settings.printed.At("table10", c.method, place)) : Cell("-");
    };
    sheet.rows.push_back({method->title, c.prior ? "CAD, uniform +-20 %" : "none", Mean(r.filtered, &Score::J_e),
                          printed(0), Mean(r.plain, &Score::J_e), printed(1), MeanOf(r.growth), printed(2),
                          Mean(r.plain, &Score::J_true), Mean(r.plain, &Score::e_d_over_prior),
                          Mean(r.plain, &Score::e_base), static_cast<double>(r.plain.size()),
                          r.why.empty() ? "-" : r.why});
    if (c.method == "instrumental_variable" && c.prior && !r.plain.empty()) {
      const std::string where = "regularised IV, no filter, " + std::to_string(r.plain.size()) + " closed-loop draws: ";
      out.goals.push_back({where + "mean J_e", Over(r.plain, &Score::J_e).mean, 0.2, true});
      out.goals.push_back({where + "draws", static_cast<double>(r.plain.size()), 20, false});
    }
  }
}

}  // namespace

void ShowInstruments(const Settings& settings, const Motions& motions, Findings& out) {
  if (!settings.Wants("10")) return;
  Sheet sheet{
      "10",
      "noise in q: instruments (17) against the pseudo-inverse (15), model (7)",
      {"method", "prior", "J_e filter", "J_e filter printed", "J_e no filter", "J_e no filter printed", "Delta J_e",
       "Delta J_e printed", "J_e* no filter", "e_d / e_d(prior)", "base error / sigma", "draws", "remark"},
      {},
      {"Tier 3: the arm runs under its robot file's 1 kHz control law with an encoder; its feed-forward uses the set "
       "parameters, as in the survey's Figure 3. q is read at 100 Hz with 1e-4 rad of noise, differentiated "
       "centrally, with and without the 20 Hz fourth-order Butterworth filter; torque noise of Table 7.",
       "Instruments come from a simulation of each method's own estimate under the same law, never of the truth. "
       "Without a prior J_e is e_d of the standard parameters' smallest answer; what instruments do is seen in "
       "the base error."}};
  const int joints = settings.robot.joints();
  const codegen::Robot arm = Variant(settings.robot, Law::kCoulombViscous, Bodies::kStandard, SetStribeck(joints));
  codegen::Model model(arm, settings.records);
  const VectorXd z = SetParameters(model);
  const codegen::Signals wanted = Sampled(motions.linear.series);
  calibration::LoopSimulator loop(model, {z, true});
  const calibration::LoopRun run = loop.Run(wanted.t, wanted.q, z);
  const Truth truth(codegen::Model(arm, settings.records), run.s, Sampled(motions.other));
  const PriorError error;
  std::vector<Result> results(std::size(kContenders));
  for (int d = 0; d < std::min(kDraws, settings.draws) && !settings.Stopped(); ++d) {
    const auto seed = settings.seed * 499 + 4 * static_cast<std::uint64_t>(d);
    const codegen::Model prior(DrawPrior(arm, error, seed), settings.records);
    const int samples = run.s.samples();
    const MatrixXd q = run.q_read + Noise(samples, VectorXd::Constant(joints, kPositionNoise_rad), seed + 1);
    const MatrixXd tau = run.tau + Noise(samples, truth.sigma_Nm, seed + 2);
    calibration::Dataset plain = Measured(Differentiated(wanted.t, q), tau);
    calibration::Dataset filtered = Measured(Filtered(wanted.t, q), tau);
    plain.source = filtered.source = kLog;
    for (std::size_t k = 0; k < results.size(); ++k) {
      const calibration::Method* method = Find(kContenders[k].method, out.missing);
      if (!method) continue;
      const auto with =
          Solve(settings, truth, prior, filtered, wanted.q, kContenders[k], error, *method, results[k].why);
      const auto without =
          Solve(settings, truth, prior, plain, wanted.q, kContenders[k], error, *method, results[k].why);
      if (with) results[k].filtered.push_back(*with);
      if (without) results[k].plain.push_back(*without);
      if (with && without) results[k].growth.push_back((without->J_e - with->J_e) / with->J_e);
    }
    settings.progress("table 10", (d + 1.0) / kDraws);
  }
  Fill(settings, results, out, sheet);
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
