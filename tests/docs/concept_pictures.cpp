// tests - draws the pictures of docs/concepts.md from small logs that are made here: their truth is known.
#include <fmt/format.h>
#include <cmath>

#include <numbers>
#include <random>

#include "host_sim/data/logs/spectrum.hpp"
#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "tests/docs/drawn.hpp"
#include "tests/docs/pictures.hpp"

namespace armcal::tests {
namespace {

using calibration::Dataset;
using calibration::Fit;
using Eigen::VectorXd;

VectorXd White(int samples, double sd, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, sd);
  return VectorXd::NullaryExpr(samples, [&](auto) { return normal(random); });
}

// The two-link arm; with a ripple on joint 1 if this is asked for.
codegen::Model TwoLink(bool ripple) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  if (ripple) robot.effect.emplace_back().effect = "torque_ripple", robot.effect.back().joints = {0};
  return {robot, codegen::ReadCatalogue("codegen/effects")};
}

// A log at 25 Hz of two sines a joint. x: the truth, in the coordinates of `model`.
Dataset Log(const codegen::Model& model, const VectorXd& x, double seconds, double frequency_Hz, double noise_Nm) {
  const int samples = static_cast<int>(25 * seconds) + 1, n = model.joints();
  Dataset d;
  d.s.t = VectorXd::LinSpaced(samples, 0, seconds);
  d.s.q.setZero(samples, n), d.s.qd = d.s.qdd = d.s.q;
  for (int j = 0; j < n; ++j)
    for (const double faster : {1.0, 2.3}) {
      const double w = 2 * std::numbers::pi * frequency_Hz * faster * (1 + 0.3 * j), a = 0.8 / faster;
      const Eigen::ArrayXd phase = w * d.s.t.array() + j;
      d.s.q.col(j).array() += a * phase.sin();
      d.s.qd.col(j).array() += a * w * phase.cos();
      d.s.qdd.col(j).array() -= a * w * w * phase.sin();
    }
  d.moving = d.used = d.sound = Eigen::MatrixXi::Ones(samples, n);
  d.scored.setOnes(samples);
  d.tau = calibration::ModelTorque(model, d, x, calibration::MeanUnknowns(model));
  for (int j = 0; j < n; ++j) d.tau.col(j) += White(samples, noise_Nm, static_cast<std::uint64_t>(10 * seconds) + j);
  return d;
}

int Column(const codegen::Model& model, const std::string& name) {
  for (int c = 0; c < model.columns(); ++c)
    if (model.column_name(c) == name) return c;
  throw std::logic_error("no column " + name);
}

report::Series Density(const std::string& name, double mean, double sd) {
  const VectorXd x = VectorXd::LinSpaced(401, 0, 4);
  const Eigen::ArrayXd z = (x.array() - mean) / sd;
  return Curve(name, x, (-0.5 * z.square()).exp() / (sd * std::sqrt(2 * std::numbers::pi)));
}

std::string DrawPrior() {
  const codegen::Model model = TwoLink(false);
  const int friction = Column(model, "Fc1");
  VectorXd truth = calibration::MakePrior(model).mean;
  truth[friction] = 1.4;
  report::Plot plot;
  plot.text = {"Coulomb friction of a joint", "Fc1 / (N m)", "probability density / (1/(N m))"};
  for (const double seconds : {0.0, 2.0, 20.0}) {
    std::vector<Dataset> logs;
    if (seconds > 0) logs.push_back(Log(model, truth, seconds, 0.2, 2));
    const Fit fit = calibration::WeightedFit(model, calibration::Pointers(logs));
    const std::string name = seconds > 0 ? fmt::format("after a log of {:g} s", seconds) : "prior";
    plot.series.push_back(Density(name, fit.x[friction], seconds > 0 ? fit.sd[friction] : fit.prior_sd[friction]));
  }
  plot.series[0].style = report::Style::kDashes;
  plot.series.push_back({.name = "true value", .x = {truth[friction], truth[friction]}, .y = {0, 2.5}});
  return File(plot);
}

std::string DrawBand() {
  constexpr double kRate_Hz = 100;
  constexpr int kSamples = 12000;
  VectorXd motion = White(kSamples, 20, 1);
  for (int k = 1; k < kSamples; ++k) motion[k] = 0.83 * motion[k - 1] + 0.17 * motion[k];  // a pole at 3 Hz
  VectorXd predicted = motion;
  const VectorXd noise = White(kSamples, 1, 2);  // as of positions: a second difference amplifies it
  for (int k = 2; k < kSamples; ++k) predicted[k] += noise[k] - 2 * noise[k - 1] + noise[k - 2];
  Dataset d;
  d.s.t = VectorXd::LinSpaced(kSamples, 0, (kSamples - 1) / kRate_Hz);
  d.tau = motion + White(kSamples, 0.3, 3);
  d.used.setOnes(kSamples, 1);
  report::Plot plot;
  plot.text = {"torque of a joint", "frequency / Hz", "density / (N m/Hz^0.5)"};
  plot.logarithmic_x = plot.logarithmic_y = true;
  for (const auto& [name, y] : {std::pair{"measured", VectorXd(d.tau)}, {"predicted from positions", predicted}}) {
    logs::Spectrum spectrum = logs::AmplitudeDensity(y, kRate_Hz, 4);
    plot.series.push_back({.name = name, .x = spectrum.f_Hz, .y = spectrum.density});
  }
  plot.shades.push_back({calibration::AgreedBand_Hz(calibration::Transfer(d, 0, predicted)), "outside of the band"});
  return File(plot);
}

std::string DrawConfirmed() {
  const codegen::Model without = TwoLink(false), with = TwoLink(true);
  VectorXd truth = calibration::MakePrior(with).mean;
  for (int c = 0; c < with.columns(); ++c)
    if (with.column_name(c).find("Rc") != std::string::npos) truth[c] = 1.5;
  const Dataset train = Log(with, truth, 6, 0.08, 0.2), test = Log(with, truth, 5, 0.06, 0.2);
  report::Plot plot;
  plot.text = {"measured minus predicted torque of a joint", "time / s", "torque / (N m)"};
  for (const auto* model : {&without, &with}) {
    const Fit fit = calibration::WeightedFit(*model, {&train});
    report::Series series{.name = model == &with ? "with the term" : "without the term"};
    double begin_s = 0;
    for (const Dataset* log : {&train, &test}) {
      const VectorXd left = (log->tau - calibration::Predict(*model, *log, fit.x, fit.eta)).col(0);
      const report::Series part = Curve("", log->s.t.array() + begin_s, left);
      series.x.insert(series.x.end(), part.x.begin(), part.x.end());
      series.y.insert(series.y.end(), part.y.begin(), part.y.end());
      begin_s += log->s.t[log->samples() - 1];
      series.x.push_back(begin_s), series.y.push_back(NAN);  // the logs do not touch
    }
    plot.series.push_back(series);
  }
  plot.shades.push_back({train.s.t[train.samples() - 1], "held-out log"});
  return File(plot);
}

}  // namespace

Pictures ConceptPictures() {
  return {{"concepts/prior.svg", DrawPrior()},
          {"concepts/band.svg", DrawBand()},
          {"concepts/confirmed.svg", DrawConfirmed()}};
}

}  // namespace armcal::tests
