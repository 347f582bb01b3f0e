// judged set - checks the detection limit, the channel and the gear against closed forms.
#include "tests/judged/detection.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/judged/forms.hpp"
#include "tests/judged/noise.hpp"

namespace armcal::judged {
namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRate_Hz = 250;
constexpr int kSamples = 20 * 250;
// An autoregression of order 30 from 5000 samples knows its spectrum to sqrt(2 * 30 / 5000): three standard deviations.
constexpr double kSpectrumError = 0.33;

struct Bench {
  plant::Random random{7};
  Arm arm = DrawArm(random, 0.1);
  Motion m = DrawMotion(arm, kSamples / kRate_Hz, kRate_Hz, random);
  MatrixXd noise{kSamples, 6};
  // A tone of amplitude 1 on the second joint: no motion of the arm has its frequency.
  MatrixXd Tone(double frequency_Hz) const {
    MatrixXd out = MatrixXd::Zero(kSamples, 6);
    out.col(1) = (2 * kPi * frequency_Hz * m.t.array()).cos();
    return out;
  }
};

TEST(Detection, ScoreOfATone_InWhiteNoise_IsItsEnergyOverTheVariance) {
  Bench b;
  constexpr double kSigma = 2;
  for (int j = 0; j < 6; ++j) b.noise.col(j) = DrawNoise("white", kSamples, kSigma, kRate_Hz, b.random);
  const Seen seen = Detector(b.arm, b.m, b.m, Channel{}, b.noise, b.random).Look(b.Tone(40));
  EXPECT_NEAR(seen.score / (kSamples / 2 / (kSigma * kSigma)), 1, kSpectrumError);
  // 10 of 125 Hz of the noise are in the band; a tone's RMS is 1 / sqrt 2.
  EXPECT_NEAR(seen.size[1], std::sqrt(0.5) / (kSigma * std::sqrt(10.0 / 125)), 0.15 * seen.size[1]);
}

TEST(Detection, ScoreOfATone_InSlowNoise_IsDividedByTheSpectrumThere) {
  Bench b;
  constexpr double kPole = 0.9, kFrequency_Hz = 5;
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < kSamples; ++k) b.noise(k, j) = (k > 0 ? kPole * b.noise(k - 1, j) : 0) + b.random.Normal();
  }
  const double w = 2 * kPi * kFrequency_Hz / kRate_Hz;
  const double white = 1 + kPole * kPole - 2 * kPole * std::cos(w), expected = kSamples / 2 * white;
  const Seen seen = Detector(b.arm, b.m, b.m, Channel{}, b.noise, b.random).Look(b.Tone(kFrequency_Hz));
  EXPECT_NEAR(seen.score / expected, 1, kSpectrumError);
}

TEST(Detection, ScoreOfWhatTheDeclaredModelHolds_IsNothing) {
  Bench b;
  for (int j = 0; j < 6; ++j) b.noise.col(j) = DrawNoise("white", kSamples, 1, kRate_Hz, b.random);
  const Detector detector(b.arm, b.m, b.m, Channel{}, b.noise, b.random);
  plant::Body payload;
  payload.mass_kg = 3, payload.center_m = {0.02, 0, 0.1}, payload.inertia_kgm2 = {0.01, 0, 0, 0.01, 0, 0.01};
  const MatrixXd carried = PayloadTorque(b.arm, b.m, payload);
  EXPECT_LT(detector.Look(carried).score, 1e-6 * carried.squaredNorm());
  MatrixXd friction = MatrixXd::Zero(kSamples, 6);
  friction.col(3) = 5 * Sign(b.m.qd.col(3)) + 3 * b.m.qd.col(3).array();
  EXPECT_LT(detector.Look(friction).score, 1e-6 * friction.squaredNorm());
  friction.col(2) = b.m.qd.col(3);  // another joint's speed is no part of it
  EXPECT_GT(detector.Look(friction).score, 0.1 * friction.col(2).squaredNorm());
}

TEST(Channel, Tone_ThroughTwoLagsAndADelay_HasTheirGainAndPhase) {
  constexpr double kPole_Hz = 5, kDelay_s = 0.01, kFrequency_Hz = 3, kStep_s = 1e-3;
  Channel c;
  c.pole_Hz = VectorXd::Constant(1, kPole_Hz), c.delay_s = VectorXd::Constant(1, kDelay_s);
  const ArrayXd t = ArrayXd::LinSpaced(4001, 0, 4), w = 2 * kPi * kFrequency_Hz * t;
  const VectorXd out = Passed(c, 0, w.sin(), kStep_s);
  const double ratio = kFrequency_Hz / kPole_Hz, gain = 1 / (1 + ratio * ratio);
  const ArrayXd expected = gain * (w - 2 * std::atan(ratio) - 2 * kPi * kFrequency_Hz * kDelay_s).sin();
  EXPECT_LT((out.array() - expected).tail(3000).abs().maxCoeff(), 1e-3);
}

TEST(Gear, StiffSpring_PassesTheLoadOn) {
  Bench b;
  const MatrixXd links = LinkTorque(b.arm, b.m);
  const auto spring = [](double w) {
    return [w](double inertia) -> GearLaw {
      return [=](double y, double rate) { return -w * w * inertia * y - 2 * 0.1 * w * inertia * rate; };
    };
  };
  const double load = std::sqrt(links.col(1).squaredNorm() / kSamples);
  const auto rms = [&](double w) {
    return std::sqrt(BehindGear(b.arm, b.m, links, 1, spring(w)).col(1).squaredNorm() / kSamples) / load;
  };
  // Far below its resonance a spring's error falls with the square of it.
  const double soft = rms(2 * kPi * 10), stiff = rms(2 * kPi * 40);
  EXPECT_LT(stiff, 0.01);
  EXPECT_NEAR(soft / stiff, 16, 10);
}

// Where the arm hardly accelerates, the link stands where its gear bends to, and the gear carries the load of that
// place.
TEST(Gear, SlowMotion_CarriesTheLoadOfWhereTheLinkStands) {
  Bench b;
  b.m.qd *= 1e-2, b.m.qdd *= 1e-4;  // the same places, passed slowly
  b.m.t *= 1e2;
  const MatrixXd links = LinkTorque(b.arm, b.m);
  double stiffness = 0;
  const MatrixXd missing = BehindGear(b.arm, b.m, links, 1, [&](double inertia) -> GearLaw {
    stiffness = std::pow(2 * kPi * 6, 2) * inertia;
    return [=](double y, double rate) { return -stiffness * (y + 0.1 * rate); };
  });
  Motion moved = b.m;
  for (int i = 0; i < 20; ++i) moved.q.col(1) = b.m.q.col(1) - LinkTorque(b.arm, moved).col(1) / stiffness;
  const MatrixXd expected = LinkTorque(b.arm, moved) - links;
  for (int j = 0; j < 6; ++j) {
    const double error = (missing.col(j) - expected.col(j)).norm();
    EXPECT_LT(error, 0.02 * expected.norm()) << j;
  }
}

}  // namespace
}  // namespace armcal::judged
