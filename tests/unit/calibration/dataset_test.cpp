// calibration tests - motion that belongs to a torque that is read late, and the mass matrix without gravity.
#include "host_sim/identify/calibration/dataset.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/calibration/windowed_sinc.hpp"

namespace armcal::calibration {
namespace {

// One joint on a cubic, which cubic interpolation gives exactly. Steps of 10 ms.
Dataset CubicMotion(int samples) {
  Dataset d;
  d.s.t = Eigen::VectorXd::LinSpaced(samples, 0, 0.01 * (samples - 1));
  d.s.q = d.s.t.array().cube(), d.s.qd = 3 * d.s.t.array().square(), d.s.qdd = 6 * d.s.t;
  d.tau.setOnes(samples, 1);
  d.used.setOnes(samples, 1), d.moving = d.used, d.sound = d.used;
  return d;
}

TEST(Delayed, Motion_IsThatOfBeforeTheTorque) {
  const Dataset d = CubicMotion(30);
  for (const double delay_s : {0.015, 0.004, 0.05}) {
    const Dataset late = Delayed(d, delay_s);
    for (int k = 0; k < 30; ++k) {
      const double t = std::max(0.0, d.s.t[k] - delay_s);  // held before the log begins
      EXPECT_NEAR(late.s.q(k, 0), t * t * t, 1e-13) << delay_s << ", row " << k;
      EXPECT_NEAR(late.s.qd(k, 0), 3 * t * t, 1e-13) << delay_s << ", row " << k;
      EXPECT_NEAR(late.s.qdd(k, 0), 6 * t, 1e-13) << delay_s << ", row " << k;
    }
    EXPECT_EQ(late.tau, d.tau);
    EXPECT_EQ(late.s.t, d.s.t);
  }
}

// One and a half steps late: rows 11 and 12 read the motion beside row 10.
TEST(Delayed, RowsThatReadAnUnusedOne_AreNotUsed) {
  Dataset d = CubicMotion(30);
  d.used(10, 0) = 0, d.sound(20, 0) = 0;
  const Dataset late = Delayed(d, 0.015);
  for (int k = 0; k < 30; ++k) {
    EXPECT_EQ(late.used(k, 0), k < 10 || k > 12) << k;
    EXPECT_EQ(late.sound(k, 0), k < 20 || k > 22) << k;
  }
}

// A mass matrix knows no gravity.
TEST(TypicalMass, OfAnArmWithoutGravity_IsTheSame) {
  const codegen::Model arm(codegen::ReadRobot("codegen/robots/two_link.toml"), tests::Records());
  codegen::Robot robot = arm.robot();
  robot.gravity_mps2 = {};
  const codegen::Model weightless(robot, tests::Records());
  const Eigen::VectorXd bodies = BodyMean(arm);
  const Eigen::MatrixXd mass = TypicalMass(arm, arm.base_map() * bodies);
  EXPECT_LT((mass - TypicalMass(weightless, weightless.base_map() * bodies)).norm(), 1e-9 * mass.norm());
  EXPECT_GT(mass.minCoeff(), 0);
}

// Noise of the positions below 15 Hz ends the band of all joints. A torque over the position of joint 2 bends the fit
// of that joint so far that its prediction is too large above the motion, which looks the same.
TEST(Band, IsLimitedByNoiseThatMostJointsShow_AndNotByWhatOneJointLacks) {
  constexpr double kSamples_Hz = 125, kNoiseBelow_Hz = 15;
  tests::SyntheticArm arm(tests::Er20(), 3);
  const auto bands_Hz = [&](double noise_rad, const tests::Effect& effect) {
    const Dataset run = arm.Run(40, 4, effect);
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    Eigen::MatrixXd noise(run.samples(), run.joints());
    for (double& each : noise.reshaped()) each = normal(random);
    logs::Log log;
    log.source = run.source, log.joints = run.joints();
    log.t = run.s.t, log.tau = run.tau;
    log.q = run.s.q + noise_rad * tests::WindowedSinc(noise, kNoiseBelow_Hz, kSamples_Hz);
    return Prepare(arm.model(), log).band_Hz;
  };
  const auto bellows = [](const tests::State& s) { return s.joint == 1 ? 400 * std::sin(3 * s.q) : 0; };
  EXPECT_TRUE(bands_Hz(3e-4, {}).array().isFinite().all());
  EXPECT_FALSE(bands_Hz(0, bellows).array().isFinite().any());
}

}  // namespace
}  // namespace armcal::calibration
