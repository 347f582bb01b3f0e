// diagnosis tests - rows of heavy-tailed noise weigh as much as they tell, and friction is steady away from turns.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "host_sim/diagnose/diagnosis/row_trust.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using Eigen::VectorXd;

constexpr int kRows = 2000;

RowIndex OneRun() {
  RowIndex rows;
  for (int k = 0; k < kRows; ++k) {
    rows.dataset.push_back(0), rows.sample.push_back(k);
    rows.segment_begin.push_back(k == 0);
  }
  return rows;
}

template <class Distribution>
VectorXd Noise(Distribution distribution, int seed) {
  std::mt19937 random(seed);
  VectorXd out(kRows);
  for (double& v : out) v = distribution(random);
  return out;
}

TEST(KnockWeights, OfNormalNoise_AreNone) {
  for (int seed = 1; seed <= 20; ++seed)
    EXPECT_EQ(KnockWeights(OneRun(), Noise(std::normal_distribution<double>(), seed)).size(), 0) << seed;
}

// The amplitude of a slow sine under such noise is estimated from runs of other seeds. Maximum likelihood has half the
// variance of least squares.
TEST(KnockWeights, OfStudentsNoise_EstimateBetter) {
  constexpr int kRuns = 200;
  VectorXd sine(kRows);
  for (int k = 0; k < kRows; ++k) sine[k] = std::sin(2 * std::numbers::pi * 7 * k / kRows);
  double plain = 0, weighted = 0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    const VectorXd tau = sine + Noise(std::student_t_distribution<double>(3), seed);
    const VectorXd w = KnockWeights(OneRun(), tau).cwiseAbs2();
    ASSERT_EQ(w.size(), kRows);
    plain += std::pow(sine.dot(tau) / sine.squaredNorm() - 1, 2);
    weighted += std::pow(sine.cwiseProduct(w).dot(tau) / sine.cwiseProduct(w).dot(sine) - 1, 2);
  }
  EXPECT_LT(weighted, 0.65 * plain);
}

// Whitening needs rows of one weight.
TEST(KnockWeights, OfColouredNoise_AreNone) {
  VectorXd left = Noise(std::student_t_distribution<double>(3), 5);
  for (int k = 2; k < kRows; ++k) left[k] += 1.6 * left[k - 1] - 0.8 * left[k - 2];
  EXPECT_EQ(KnockWeights(OneRun(), left).size(), 0);
}

// A torque of two deviations that lasts fifty rows keeps its weight; the noise about it does not change that.
TEST(KnockWeights, OfWhatLasts_AreThoseOfTheRowsAboutIt) {
  VectorXd left = Noise(std::student_t_distribution<double>(3), 5);
  const VectorXd before = KnockWeights(OneRun(), left);
  constexpr int kFrom = 800, kLength = 50;
  for (int k = 0; k < kLength; ++k) left[kFrom + k] += 3;
  const VectorXd after = KnockWeights(OneRun(), left);
  constexpr int kInside = kLength - 8;
  EXPECT_NEAR(after.segment(kFrom + 4, kInside).mean(), before.segment(kFrom + 4, kInside).mean(), 0.02);
}

// Joint 2 of the small arm sweeps by a sine: friction changes its sign twice a period.
TEST(SteadyFriction, IsWhereTheSignStays_ForAsLongAsTheSpeedResolves) {
  const codegen::Model model(codegen::ReadRobot("codegen/robots/two_link.toml"), tests::Records());
  constexpr double kRate_Hz = 100, kPeriod_s = 4, kCutoff_Hz = 5;
  calibration::Dataset d;
  d.s.t = VectorXd::LinSpaced(kRows, 0, (kRows - 1) / kRate_Hz);
  d.s.q.setZero(kRows, 2), d.s.qd = d.s.q;
  for (int k = 0; k < kRows; ++k) d.s.qd(k, 1) = std::cos(2 * std::numbers::pi * (d.s.t[k] + 0.003) / kPeriod_s);
  d.cutoff_Hz.setConstant(2, kCutoff_Hz);
  const VectorXd steady = SteadyFriction(model, d, 1);
  for (int k = 0; k < kRows; ++k) {
    const double phase_s = std::fmod(d.s.t[k] + 0.003 + kPeriod_s / 4, kPeriod_s / 2);  // since a turn
    const double apart_s = std::min(phase_s, kPeriod_s / 2 - phase_s);
    if (std::abs(apart_s - 0.5 / kCutoff_Hz) < 0.02) continue;
    EXPECT_EQ(steady[k], apart_s > 0.5 / kCutoff_Hz) << d.s.t[k];
  }
  EXPECT_EQ(SteadyFriction(model, d, 0).minCoeff(), 1);  // it stands
}

}  // namespace
}  // namespace armcal::diagnosis
