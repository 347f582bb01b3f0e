// calibration tests - the band is found on signals whose spectra are known by construction, and averages lose nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "host_sim/identify/calibration/band.hpp"
#include "tests/unit/calibration/windowed_sinc.hpp"

namespace armcal::calibration {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kRate_Hz = 100, kLength_s = 120, kTau = 2 * std::numbers::pi;

// One joint, every sample used.
Dataset OneJoint(const VectorXd& tau) {
  Dataset d;
  d.s.t = VectorXd::LinSpaced(tau.size(), 0, static_cast<double>(tau.size() - 1) / kRate_Hz);
  d.tau = tau;
  d.used.setOnes(tau.size(), 1);
  d.band_Hz.setConstant(1, INFINITY);
  return d;
}

VectorXd White(std::uint64_t seed, double sd) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, sd);
  VectorXd out(static_cast<Index>(kRate_Hz * kLength_s));
  for (double& x : out) x = normal(random);
  return out;
}

// A pole at this frequency, run forward.
VectorXd LowPass(const VectorXd& x, double pole_Hz) {
  VectorXd y = x;
  const double keep = std::exp(-kTau * pole_Hz / kRate_Hz);
  for (Index k = 1; k < x.size(); ++k) y[k] = keep * y[k - 1] + (1 - keep) * x[k];
  return y;
}

VectorXd Difference(const VectorXd& x) {
  VectorXd y = VectorXd::Zero(x.size());
  y.tail(x.size() - 1) = x.tail(x.size() - 1) - x.head(x.size() - 1);
  return y;
}

TEST(Band, NoiseOfTheDerivative_LowersTheGain_AndEndsTheBandWhereItBegins) {
  // Motion has a pole at 3 Hz; the prediction's noise rises as a second derivative's does. Densities at f, from the
  // difference equations: motion |H|^2 with H = (1 - a) / (1 - a z), noise s^2 (2 sin(pi f / rate))^4.
  const VectorXd motion = LowPass(White(1, 1), 3);
  const double s = 0.15;
  const VectorXd prediction = motion + Difference(Difference(White(2, s)));
  const auto transfer = Transfer(OneJoint(motion + White(3, 0.02)), 0, prediction);
  ASSERT_GT(transfer.size(), 10u);
  double expected_Hz = 0;
  for (const TransferBand& band : transfer) {
    const double f = std::sqrt(band.lower_Hz * band.upper_Hz), a = std::exp(-kTau * 3 / kRate_Hz);
    const double signal = (1 - a) * (1 - a) / (1 + a * a - 2 * a * std::cos(kTau * f / kRate_Hz));
    const double noise = s * s * std::pow(2 * std::sin(std::numbers::pi * f / kRate_Hz), 4);
    const double gain = signal / (signal + noise);
    EXPECT_NEAR(band.gain, gain, 0.04 + 4 * band.gain_sd) << f << " Hz";
    if (gain > 0.9) expected_Hz = f;
  }
  EXPECT_NEAR(std::log2(AgreedBand_Hz(transfer) / expected_Hz), 0, 0.67);  // within two thirds of an octave
}

TEST(Band, ALateOrFilteredTorque_IsNoLimit) {
  const VectorXd motion = LowPass(White(4, 1), 10);
  VectorXd late = motion;
  late.tail(late.size() - 3) = motion.head(motion.size() - 3);
  for (const VectorXd& torque : {VectorXd(late), LowPass(motion, 4)}) {
    const auto transfer = Transfer(OneJoint(torque + White(5, 1e-3)), 0, motion);
    EXPECT_EQ(AgreedBand_Hz(transfer), INFINITY);
  }
}

TEST(Band, AFilterBeforeTheLogWasSaved_IsFoundAtItsEdge) {
  const VectorXd motion = LowPass(White(8, 1), 3);
  // The spectrum has a bin every 0.8 Hz, and three are taken together.
  for (const double edge_Hz : {15.0, 20.0, 28.0})
    EXPECT_NEAR(FilteredAbove_Hz(OneJoint(tests::WindowedSinc(motion + White(9, 0.1), edge_Hz, kRate_Hz)), 0, motion),
                edge_Hz, 1.6);
}

TEST(Band, ALag_ABelt_AndASmoothMotion_AreNoFilter) {
  const VectorXd motion = LowPass(White(10, 1), 3), smooth = tests::WindowedSinc(motion, 4, kRate_Hz),
                 noise = White(11, 0.01);
  EXPECT_EQ(FilteredAbove_Hz(OneJoint(LowPass(motion, 4) + noise), 0, motion), INFINITY);
  EXPECT_EQ(FilteredAbove_Hz(OneJoint(LowPass(LowPass(motion, 4), 4) + noise), 0, motion), INFINITY);
  EXPECT_EQ(FilteredAbove_Hz(OneJoint(smooth + noise), 0, smooth), INFINITY);
}

TEST(Band, ATorqueThatNeverChanges_WasNotFiltered) {  // a brake holds the joint
  const VectorXd motion = LowPass(White(10, 1), 3);
  for (const double held : {0.0, 0.3})
    EXPECT_EQ(FilteredAbove_Hz(OneJoint(VectorXd::Constant(motion.size(), held)), 0, motion), INFINITY);
}

TEST(Band, NoiseOfTheTorque_IsNoLimit) {
  const VectorXd motion = LowPass(White(6, 1), 2);
  EXPECT_EQ(AgreedBand_Hz(Transfer(OneJoint(motion + White(7, 1)), 0, motion)), INFINITY);
}

// Prediction and torque differ by a straight line in time, which has nothing at these frequencies. In 0.3 s of each
// second no sample is used: a line stays a line there.
TEST(Band, SamplesThatAreNotUsed_BreakNoStraightLine) {
  const VectorXd motion = LowPass(White(12, 1), 10);
  VectorXd torque = motion + 5 * OneJoint(motion).s.t;
  Dataset d = OneJoint(torque);
  for (Index k = 0; k < torque.size(); ++k)
    if (k % 100 < 30) d.used(k, 0) = 0, d.tau(k, 0) = 1e6;
  int bands = 0;
  for (const TransferBand& band : Transfer(d, 0, motion)) {
    if (band.lower_Hz < 3) continue;  // below, a segment shows that the line has ends
    EXPECT_GT(band.coherence, 0.99) << band.lower_Hz << " Hz";
    EXPECT_NEAR(band.gain, 1, 0.01) << band.lower_Hz << " Hz";
    ++bands;
  }
  EXPECT_GT(bands, 8);
}

TEST(Band, Average_Takes3dBAtTheBand_AndKeepsAModelThatHoldsAtEverySample) {
  const Index samples = static_cast<Index>(kRate_Hz * kLength_s);
  VectorXd tone(samples), slow(samples);
  for (Index k = 0; k < samples; ++k) {
    tone[k] = std::sin(kTau * 6.02 * static_cast<double>(k) / kRate_Hz);
    slow[k] = std::sin(kTau * 0.31 * static_cast<double>(k) / kRate_Hz);
  }
  Dataset d = OneJoint(tone);
  d.band_Hz[0] = 6;
  const auto average = AverageRows(d, 0);
  EXPECT_NEAR(static_cast<double>(average.rows()), 2 * 6 * kLength_s, 3);
  // RMS of rows over RMS of samples: sqrt(1/2); the window ends at three of its deviations, which is 1 %.
  EXPECT_NEAR((average * tone).norm() / std::sqrt(average.rows()) / (tone.norm() / std::sqrt(samples)), std::sqrt(0.5),
              0.02);
  const VectorXd model = 3 * tone - 2 * slow;
  EXPECT_LT((average * model - (3 * (average * tone) - 2 * (average * slow))).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Band, SamplesThatAreNotUsed_AreInNoAverage) {
  VectorXd tau = VectorXd::Ones(static_cast<Index>(kRate_Hz * kLength_s));
  Dataset d = OneJoint(tau);
  d.band_Hz[0] = 5;
  for (Index k = 0; k < tau.size(); k += 17) d.used(k, 0) = 0, tau[k] = 1e6;
  for (Index k = 2000; k < 2100; ++k) d.used(k, 0) = 0, tau[k] = 1e6;  // a second: rows there are left out
  const auto average = AverageRows(d, 0);
  EXPECT_LT((average * tau - VectorXd::Ones(average.rows())).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(static_cast<double>(average.rows()), 2 * 5 * (kLength_s - 1), 3);
}

}  // namespace
}  // namespace armcal::calibration
