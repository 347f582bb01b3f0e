// logs tests - compare derivatives with analytic motion: no false elasticity, no phase, the right cut-off.
#include "host_sim/data/logs/signals.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"

namespace armcal::logs {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kTau = 2 * std::numbers::pi;

// Sines of amplitude (0.2 rad/s) / w at several frequencies, with exact derivatives.
struct MultiSine {
  std::vector<double> frequency_Hz;

  double Value(double t, int order) const {
    double sum = 0;
    for (const double f : frequency_Hz) {
      const double w = kTau * f;
      sum += 0.2 / w * std::pow(w, order) * std::sin(w * t + f + order * std::numbers::pi / 2);
    }
    return sum;
  }
};

Log MakeLog(const MultiSine& motion, const VectorXd& t, double encoder_step_rad, double torque_noise_Nm) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, torque_noise_Nm);
  Log log;
  log.joints = 1;
  log.source = "made";
  log.t = t;
  log.q.resize(t.size(), 1);
  log.tau.resize(t.size(), 1);
  for (Index k = 0; k < t.size(); ++k) {
    const double q = motion.Value(t[k], 0);
    log.q(k, 0) = encoder_step_rad > 0 ? encoder_step_rad * std::round(q / encoder_step_rad) : q;
    log.tau(k, 0) = 40 * motion.Value(t[k], 2) + noise(random);
  }
  return log;
}

VectorXd Uniform(double seconds, double rate_Hz) {
  const auto samples = static_cast<Index>(seconds * rate_Hz) + 1;
  return VectorXd::LinSpaced(samples, 0, static_cast<double>(samples - 1) / rate_Hz);
}

// Complex amplitude of x at f over the samples away from the ends, by least squares on cos and sin at all frequencies.
std::vector<std::complex<double>> Amplitudes(const VectorXd& t, const VectorXd& x, const std::vector<double>& f) {
  const Index skip = t.size() / 10, count = t.size() - 2 * skip;
  Eigen::MatrixXd basis(count, 2 * static_cast<Index>(f.size()));
  for (Index k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < f.size(); ++i) {
      basis(k, 2 * static_cast<Index>(i)) = std::cos(kTau * f[i] * t[skip + k]);
      basis(k, 2 * static_cast<Index>(i) + 1) = std::sin(kTau * f[i] * t[skip + k]);
    }
  }
  const VectorXd c = (basis.transpose() * basis).ldlt().solve(basis.transpose() * x.segment(skip, count));
  std::vector<std::complex<double>> amplitude;
  for (std::size_t i = 0; i < f.size(); ++i)
    amplitude.emplace_back(c[2 * static_cast<Index>(i)], -c[2 * static_cast<Index>(i) + 1]);
  return amplitude;
}

TEST(Signals, MultiSineWithEncoder_AccelerationHasUnitGainAndNoPhaseBelowTenHertz) {
  const MultiSine motion{{0.3, 1.1, 2.7, 5.2, 7.9, 9.8}};
  const VectorXd t = Uniform(40, 250);
  const Log log = MakeLog(motion, t, kTau / (131072 * 100), 3.0);
  const Derivatives d = DeriveSignals(log, {40.0 * Eigen::MatrixXd::Identity(1, 1)});
  EXPECT_GT(d.cutoff_Hz[0], 40);
  for (int order = 1; order <= 2; ++order) {
    VectorXd truth(t.size());
    for (Index k = 0; k < t.size(); ++k) truth[k] = motion.Value(t[k], order);
    const auto want = Amplitudes(t, truth, motion.frequency_Hz);
    const auto got = Amplitudes(t, order == 1 ? d.qd.col(0) : d.qdd.col(0), motion.frequency_Hz);
    for (std::size_t i = 0; i < want.size(); ++i) {
      // 0.1 % of gain: a hundredth of what central differences lose at 10 Hz and 250 Hz.
      EXPECT_LT(std::abs(got[i] / want[i] - 1.0), 1e-3) << motion.frequency_Hz[i] << " Hz, order " << order;
    }
  }
}

TEST(Signals, CentralDifferences_FailTheSameCheck) {  // the check can see a fake elasticity
  const MultiSine motion{{9.8}};
  const VectorXd t = Uniform(40, 250);
  VectorXd q(t.size()), truth(t.size());
  for (Index k = 0; k < t.size(); ++k) q[k] = motion.Value(t[k], 0), truth[k] = motion.Value(t[k], 2);
  VectorXd qdd = VectorXd::Zero(t.size());
  for (Index k = 2; k + 2 < t.size(); ++k) qdd[k] = (q[k + 2] - 2 * q[k] + q[k - 2]) * 250 * 250 / 4;
  EXPECT_GT(std::abs(Amplitudes(t, qdd, {9.8})[0] / Amplitudes(t, truth, {9.8})[0] - 1.0), 1e-2);
}

TEST(Signals, JitteringTimeGrid_IsDerivedAtItsOwnTimes) {
  const MultiSine motion{{0.4, 2.3, 6.1}};
  VectorXd t = Uniform(20, 200);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> jitter(-0.0005, 0.0005);
  for (Index k = 1; k + 1 < t.size(); ++k) t[k] += jitter(random);
  const Derivatives d = DeriveSignals(MakeLog(motion, t, 0, 1.0), {1.0 * Eigen::MatrixXd::Identity(1, 1)});
  double worst = 0;
  for (Index k = 0; k < t.size(); ++k) {
    if (d.settled[k]) worst = std::max(worst, std::abs(d.qdd(k, 0) - motion.Value(t[k], 2)));
  }
  EXPECT_LT(worst, 1e-3 * 0.2 * kTau * 6.1);  // 0.1 % of the largest acceleration amplitude
}

TEST(Signals, WideGap_IsNotBridged) {
  const MultiSine motion{{0.5, 1.5}};
  VectorXd t = Uniform(20, 250);
  const Index cut = t.size() / 2;
  t.tail(t.size() - cut).array() += 0.31;  // the motion goes on during the gap
  Log log = MakeLog(motion, t, 0, 1.0);
  log.gaps = {static_cast<int>(cut - 1)};
  const Derivatives d = DeriveSignals(log, {1.0 * Eigen::MatrixXd::Identity(1, 1)});
  EXPECT_EQ(d.settled[cut - 1], 0);
  EXPECT_EQ(d.settled[cut], 0);
  for (Index k = 0; k < t.size(); ++k) {
    if (!d.settled[k]) continue;
    // What the reflection at an end leaves after 3 periods of the cut-off: 0.1 % of 2.5 rad/s^2.
    EXPECT_NEAR(d.qdd(k, 0), motion.Value(t[k], 2), 5e-3) << t[k];
  }
}

// A log at 1 kHz that lacks eight samples every second: an arm hardly moves in that time.
TEST(Signals, GapsOfEightMilliseconds_AreBridged_AtAnyRate) {
  const MultiSine motion{{0.5, 1.5}};
  const VectorXd whole = Uniform(20, 1000);
  VectorXd t = whole;
  std::vector<int> gaps;
  for (Index k = 1000; k < t.size(); k += 1000) {
    t.tail(t.size() - k).array() += 0.008;
    gaps.push_back(static_cast<int>(k - 1));
  }
  const auto error = [&](const VectorXd& at, const std::vector<int>& holes) {
    Log log = MakeLog(motion, at, 1e-5, 1.0);
    log.gaps = holes;
    const Derivatives d = DeriveSignals(log, {1.0 * Eigen::MatrixXd::Identity(1, 1)});
    double square = 0;
    int count = 0;
    for (Index k = 0; k < at.size(); ++k) {
      if (at[k] < 2 || at[k] > at[at.size() - 1] - 2) continue;
      EXPECT_EQ(d.settled[k], 1) << at[k];
      square += std::pow(d.qdd(k, 0) - motion.Value(at[k], 2), 2);
      ++count;
    }
    return std::sqrt(square / count);
  };
  EXPECT_LT(error(t, gaps), 1.1 * error(whole, {}));  // what the encoder's steps leave, at one cut-off
}

double ChosenCutoff_Hz(const JointNoise& noise, double inertia, double rate_Hz, double width_radps = INFINITY) {
  return std::max(QuietCutoff_Hz(noise, inertia, rate_Hz, width_radps), MotionCutoff_Hz(noise, rate_Hz));
}

TEST(Signals, CutOff_IsTheHighestThatKeepsEncoderNoiseBelowItsShare) {
  const double rate_Hz = 250, inertia = 40;
  std::mt19937_64 random(11);
  std::normal_distribution<double> white(0, 1);
  for (const double position_rad : {2e-7, 5e-7, 1e-6}) {
    const JointNoise noise{position_rad, 3.0};
    const double cutoff_Hz = ChosenCutoff_Hz(noise, inertia, rate_Hz);
    ASSERT_GT(cutoff_Hz, 20);
    ASSERT_LT(cutoff_Hz, 60);
    Log log;
    log.joints = 1;
    log.t = Uniform(200, rate_Hz);
    log.q.resize(log.t.size(), 1);
    for (double& q : log.q.reshaped()) q = position_rad * white(random);
    const VectorXd filtered = ZeroPhaseLowPass(log.q.col(0), cutoff_Hz, rate_Hz);
    const Eigen::MatrixXd qdd = QuinticSpline(log.t, filtered).Evaluate(log.t, 2);
    const double torque = inertia * std::sqrt(qdd.col(0).squaredNorm() / static_cast<double>(qdd.rows()));
    // 7 %: the analytic integral runs to infinity and the filter is warped near half the rate; statistics add 1 %.
    EXPECT_NEAR(torque / (0.07 * noise.torque_Nm), 1.0, 0.07) << cutoff_Hz << " Hz";
  }
  EXPECT_EQ(ChosenCutoff_Hz({0, 3.0}, inertia, rate_Hz), 60);
  EXPECT_EQ(ChosenCutoff_Hz({1, 3.0}, inertia, rate_Hz), 20);
  EXPECT_EQ(ChosenCutoff_Hz({0, 3.0}, inertia, 100), 40);
}

// Joint 2 is held by a brake. Its torque has no noise, and that asks nothing of joint 1, which moves it.
TEST(Signals, CutOff_OfAJointBesideABrakedOne_IsItsOwn) {
  const Log own = MakeLog({{0.3, 1.1, 2.7}}, Uniform(40, 250), 5e-6, 3.0);
  Log both = own;
  both.joints = 2;
  both.q.conservativeResize(Eigen::NoChange, 2), both.tau.conservativeResize(Eigen::NoChange, 2);
  both.q.col(1).setConstant(0.4), both.tau.col(1).setConstant(1.5);
  const double alone_Hz = ChooseCutoffs_Hz(own, {40.0 * Eigen::MatrixXd::Identity(1, 1)})[0];
  EXPECT_GT(alone_Hz, 21);
  EXPECT_EQ(ChooseCutoffs_Hz(both, {(Eigen::Matrix2d() << 40, 8, 8, 5).finished()})[0], alone_Hz);
}

TEST(Signals, NoiseOfEncoderAndTorque_AreFoundUnderMotion) {
  const MultiSine motion{{0.3, 1.1, 2.7}};
  const double step = 2e-5;
  const JointNoise noise = EstimateNoise(MakeLog(motion, Uniform(40, 250), step, 3.0), 0);
  EXPECT_NEAR(noise.position_rad, step / std::sqrt(12.0), 0.1 * step);
  EXPECT_NEAR(noise.torque_Nm, 3.0, 0.15);  // 10000 samples: 1 % statistics; 40 kg m^2 x the motion adds the rest
}

TEST(Signals, PositionWithoutSteps_HasNoneByChance) {
  // The smallest of 5000 changes is some 1e-6 rad here; the sixth difference of the motion itself is below 1e-9.
  const JointNoise noise = EstimateNoise(MakeLog({{0.3, 1.1, 2.7}}, Uniform(40, 125), 0, 3.0), 0);
  EXPECT_LT(noise.position_rad, 1e-8);
}

TEST(Signals, MotionBand_EndsWhereTheHighestToneDoes) {
  const double noise = 5e-6;
  std::mt19937_64 random(12);
  std::normal_distribution<double> white(0, noise);
  for (const double highest_Hz : {2.7, 8.3}) {
    Log log = MakeLog({{0.3, 1.1, highest_Hz}}, Uniform(60, 250), 1e-9, 3.0);
    for (double& q : log.q.reshaped()) q += white(random);
    // segments of 1024 samples: a tone is four bins wide on either side, and two neighbours are averaged
    EXPECT_NEAR(MotionBand_Hz(log.q.col(0), noise, 250), highest_Hz, 6 * 250.0 / 1024);
  }
}

TEST(Signals, CoarseEncoderUnderSlowMotion_IsSmoothedFurther_ButNeverIntoTheMotion) {
  const JointNoise slow{1, 3.0, 3.0}, fast{1, 3.0, 50};  // noise that calls for the lowest cut-off
  EXPECT_DOUBLE_EQ(ChosenCutoff_Hz(slow, 40, 250), 4.5);
  EXPECT_EQ(ChosenCutoff_Hz(fast, 40, 250), 20);
  // A joint that stands has no motion of its own: its cut-off must not make a log's ends unusable for all joints.
  EXPECT_EQ(ChosenCutoff_Hz({1, 3.0, 0}, 40, 250), 20);
  EXPECT_EQ(ChosenCutoff_Hz({1, 3.0, 0.01}, 40, 250), 2);
  // friction's sign: noise of speed stays below a twentieth of the width
  const JointNoise fine{1e-5, 3.0};
  const double cutoff_Hz = ChosenCutoff_Hz(fine, 0, 250, 0.01);
  const double s = 1e-5 * kTau * std::sqrt(2.0 / 250 * 0.2657) * std::pow(cutoff_Hz, 1.5);
  EXPECT_NEAR(s, 0.05 * 0.01, 1e-9);
}

TEST(Signals, CutoffScale_ScalesAndChangesNothingElse) {
  const Log log = MakeLog({{0.3, 1.1}}, Uniform(10, 250), 1e-5, 3.0);
  const Sensitivity inertia{40.0 * Eigen::MatrixXd::Identity(1, 1)};
  EXPECT_DOUBLE_EQ(DeriveSignals(log, inertia, {0, 0.62}).cutoff_Hz[0],
                   0.62 * DeriveSignals(log, inertia).cutoff_Hz[0]);
  EXPECT_THROW(DeriveSignals(log, {40.0 * Eigen::MatrixXd::Identity(2, 2)}), io::InputError);
}

// Two tones, 2 Hz and 30 Hz. The filter runs both ways, so its gain is the square of a fourth order's.
TEST(Signals, ACutoffOfTheUsersOwn_KeepsTheToneBelowAndTakesTheOneAbove) {
  constexpr double kSlow_Hz = 2, kFast_Hz = 30, kCutoff_Hz = 8;
  Log log = MakeLog({{0.3, kSlow_Hz}}, Uniform(10, 250), 1e-9, 3.0);
  const Eigen::VectorXd fast = (kTau * kFast_Hz * log.t.array()).sin();
  log.q.col(0) += 1e-3 * fast;
  const Sensitivity inertia{40.0 * Eigen::MatrixXd::Identity(1, 1)};
  const auto tone_left = [&](const Bandwidth& bandwidth) {  // of the acceleration, away from the ends
    const Derivatives d = DeriveSignals(log, inertia, bandwidth);
    const Eigen::Index edge = 500, count = log.samples() - 2 * edge;
    return std::abs(d.qdd.col(0).segment(edge, count).dot(fast.segment(edge, count))) /
           (1e-3 * std::pow(kTau * kFast_Hz, 2) * fast.segment(edge, count).squaredNorm());
  };
  const double gain = 1 / (1 + std::pow(kFast_Hz / kCutoff_Hz, 8));
  EXPECT_LT(tone_left({kCutoff_Hz}), 2 * gain + 1e-4);  // 1e-4: of the other tone, over a number of periods not whole
  EXPECT_GT(tone_left({100}), 0.98);                    // from 0.4 of the rate on nothing is filtered
  const Derivatives half = DeriveSignals(log, inertia, {kCutoff_Hz, 0.5});
  EXPECT_EQ(half.cutoff_Hz[0], 0.5 * kCutoff_Hz);
}

// A log at 100 Hz has the highest cut-off, 40 Hz. Stamps in seconds since 1970 are rounded to 0.24 us as double, so its
// median step and its length tell slightly different rates.
TEST(Signals, ThePositionOfTheHighestCutoff_IsNotSmoothed_HoweverItsStampsAreRounded) {
  constexpr double kTone_Hz = 35;
  const VectorXd t = Uniform(20, 100);
  const auto gain = [&](const VectorXd& stamps) {
    Log log = MakeLog({{0.3, kTone_Hz}}, t, 0, 3.0);
    log.t = stamps;
    const Derivatives d = DeriveSignals(log, {1e-3 * Eigen::MatrixXd::Identity(1, 1)});
    EXPECT_NEAR(d.cutoff_Hz[0], 40, 0.01);
    return std::abs(Amplitudes(t, d.q.col(0), {0.3, kTone_Hz})[1]) / (0.2 / (kTau * kTone_Hz));
  };
  constexpr double kSince1970_s = 1700000000.123456;
  const VectorXd rounded = (t.array() + kSince1970_s).matrix();
  EXPECT_NEAR(gain(t), 1, 1e-3);
  EXPECT_NEAR(gain((rounded.array() - rounded[0]).matrix()), 1, 1e-3);
}

TEST(Signals, ACutoffThatTheLogCannotHave_IsRefused) {
  const Log log = MakeLog({{0.3, 1.1}}, Uniform(10, 250), 1e-5, 3.0);
  const Sensitivity inertia{40.0 * Eigen::MatrixXd::Identity(1, 1)};
  EXPECT_NO_THROW(DeriveSignals(log, inertia, {124}));
  EXPECT_THROW(DeriveSignals(log, inertia, {125}), io::InputError);
  EXPECT_NO_THROW(DeriveSignals(log, inertia, {0.7}));
  EXPECT_THROW(DeriveSignals(log, inertia, {0.6}), io::InputError);  // three periods at either end are the whole log
}

TEST(Butterworth, GainIsTheSquareOfOrderFour_AndLinesPassUnchanged) {
  const double rate_Hz = 1000, cutoff_Hz = 40;
  const VectorXd t = Uniform(4, rate_Hz);
  for (const double f : {5.0, 20.0, 40.0, 60.0}) {
    const VectorXd y = ZeroPhaseLowPass((kTau * f * t).array().sin().matrix(), cutoff_Hz, rate_Hz);
    const double warped = std::tan(std::numbers::pi * f / rate_Hz) / std::tan(std::numbers::pi * cutoff_Hz / rate_Hz);
    EXPECT_NEAR(std::abs(Amplitudes(t, y, {f})[0]), 1 / (1 + std::pow(warped, 8)), 1e-6) << f;
  }
  const VectorXd line = 3.0 * t.array() + 2.0;
  EXPECT_LT((ZeroPhaseLowPass(line, cutoff_Hz, rate_Hz) - line).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(QuinticSpline, ReproducesPolynomialsOfDegreeFiveOnAnIrregularGrid) {
  VectorXd t = Uniform(1, 30);
  for (Index k = 1; k + 1 < t.size(); ++k) t[k] += 0.008 * std::sin(5.0 * static_cast<double>(k));
  const auto x = t.array();
  Eigen::MatrixXd y(t.size(), 2);
  y.col(0) = 1 - 2 * x + 3 * x.pow(5);
  y.col(1) = x.pow(3);
  const QuinticSpline spline(t, y);
  const VectorXd at = VectorXd::LinSpaced(500, 0, 1);
  // Rounding: 1e-16 of values of order 1, times 1/step^2 for the second derivative, with margin.
  EXPECT_LT((spline.Evaluate(at, 0).col(0).array() - (1 - 2 * at.array() + 3 * at.array().pow(5))).abs().maxCoeff(),
            1e-12);
  EXPECT_LT((spline.Evaluate(at, 1).col(0).array() - (-2 + 15 * at.array().pow(4))).abs().maxCoeff(), 1e-10);
  EXPECT_LT((spline.Evaluate(at, 2).col(1).array() - 6 * at.array()).abs().maxCoeff(), 1e-8);
}

}  // namespace
}  // namespace armcal::logs
