// replay tests - multiple shooting finds the parameters of an exactly solved axis, and the drift of its torque's zero.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "tests/unit/replay/one_axis.hpp"

namespace armcal::replay {
namespace {

using tests::Axis;

// EMPS in small: 20 s at 500 Hz, four periods. The measured force drifts by `drift` from the middle to the end.
logs::Log Made(const Axis& axis, double drift, double position_noise) {
  logs::Log log;
  const int samples = 10001;
  log.joints = 1, log.source = "made up";
  log.t = Eigen::VectorXd::LinSpaced(samples, 0, 20);
  log.q.setZero(samples, 1), log.tau = log.q;
  for (int k = 0; k < samples; ++k) {
    const double phase = 2 * std::numbers::pi * log.t[k] / 5;
    log.tau(k, 0) = axis.offset + 60 * std::cos(phase) + 40 * std::sin(3 * phase) + 30 * std::cos(11 * phase);
  }
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, position_noise);
  double q = 0.2, v = 0;
  for (int k = 0; k < samples; ++k) {
    log.q(k, 0) = q + noise(random);
    if (k + 1 < samples) axis.Move(0.5 * (log.tau(k, 0) + log.tau(k + 1, 0)), log.t[k + 1] - log.t[k], q, v);
  }
  for (int k = 0; k < samples; ++k) log.tau(k, 0) += drift * (log.t[k] - 10) / 10;
  return log;
}

struct Case {
  logs::Log log;
  std::vector<Training> training;
  calibration::Fit fit;

  Case(const Axis& axis, double drift) : log(Made(axis, drift, 1e-6)) {
    const calibration::Dataset data = calibration::Prepare(tests::AxisModel(), log);
    fit = calibration::WeightedFit(tests::AxisModel(), {&data});
    training = {MakeTraining(log, data)};
  }
};

double Worst(const Axis& axis, const Eigen::VectorXd& x) {
  const Eigen::VectorXd truth = axis.parameters().z;
  return ((x.head(truth.size()) - truth).cwiseQuotient(truth)).cwiseAbs().maxCoeff();
}

constexpr Axis kTruth{95, 200, 20, -3};

TEST(Refine, FindsParametersAndDrift_FromAWrongStart) {
  Case c(kTruth, 0.5);
  c.fit.x *= 1.05;                                      // planted: 5 % off
  c.fit.covariance *= std::pow(0.05 / 0.004, 2) / 100;  // and said to be so
  RefineSettings settings;
  settings.block_s = 5, settings.tries = 3;
  const Refined r = Refine(tests::AxisModel(), c.training, c.fit, settings);
  EXPECT_LT(Worst(kTruth, r.x), 0.005);
  EXPECT_NEAR(r.drift(0, 0), 0.5, 0.02);
  EXPECT_LT(r.rms[0], 1e-4);
  EXPECT_EQ(r.tries, 3);
  EXPECT_GE(r.agree, 2);
  ASSERT_EQ(r.lengths.size(), 6u);
  const auto best = std::min_element(r.lengths.begin(), r.lengths.end(),
                                     [](const auto& a, const auto& b) { return a.error < b.error; });
  EXPECT_EQ(best->segment_s, r.segment_s);
}

TEST(Refine, ResampledBlocks_GiveOtherParametersForOtherSeedsAndTheSameForOne) {
  const Case c(kTruth, 0);
  RefineSettings settings;
  settings.block_s = 5, settings.segment_s = 5, settings.tries = 1, settings.resample = true;
  const Refined a = Refine(tests::AxisModel(), c.training, c.fit, settings);
  const Refined same = Refine(tests::AxisModel(), c.training, c.fit, settings);
  settings.seed = 2;
  const Refined other = Refine(tests::AxisModel(), c.training, c.fit, settings);
  EXPECT_EQ(a.x, same.x);
  EXPECT_NE(a.x, other.x);
  EXPECT_LT(Worst(kTruth, a.x), 0.01);
  EXPECT_LT(Worst(kTruth, other.x), 0.01);
}

TEST(Refine, ALogShorterThanTwoBlocks_IsRefused) {
  const Case c(kTruth, 0);
  RefineSettings settings;
  settings.block_s = 15;
  EXPECT_THROW(Refine(tests::AxisModel(), c.training, c.fit, settings), io::InputError);
}

}  // namespace
}  // namespace armcal::replay
