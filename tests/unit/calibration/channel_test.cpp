// calibration tests - a channel is found in torques that an integration in small steps has filtered, and in no others.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "host_sim/identify/calibration/channel.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// y' = (u(t - late) - y) / lag in fifty steps a sample; u is linear between samples.
VectorXd Integrated(const VectorXd& t, const VectorXd& u, double lag_s, double late_s) {
  constexpr int kSteps = 50;
  const auto at = [&](double time) {
    const double step_s = t[1] - t[0],
                 place = std::clamp((time - t[0]) / step_s, 0.0, static_cast<double>(t.size() - 1));
    const Index k = std::min<Index>(static_cast<Index>(place), t.size() - 2);
    return u[k] + (place - static_cast<double>(k)) * (u[k + 1] - u[k]);
  };
  VectorXd out(t.size());
  double y = at(t[0] - late_s);
  out[0] = y;
  for (Index k = 1; k < t.size(); ++k) {
    const double dt = (t[k] - t[k - 1]) / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double middle = at(t[k - 1] + (i + 0.5) * dt - late_s);
      y += (1 - std::exp(-dt / lag_s)) * (middle - y);
    }
    out[k] = y;
  }
  return out;
}

struct Arm {
  std::mt19937_64 random{3};
  std::normal_distribution<double> normal;
  tests::SyntheticArm arm{tests::Er20(), 5};
  Dataset log = arm.Run(40, 6);
  void Measure(int j, double lag_s, double late_s, int lags = 1) {
    for (int pass = 0; pass < lags; ++pass)
      log.tau.col(j) = Integrated(log.s.t, log.tau.col(j), lag_s, pass == 0 ? late_s : 0);
  }
  void Disturb(int j, double share) {  // by white noise of this share of the torque
    const double sd = share * std::sqrt(log.tau.col(j).squaredNorm() / static_cast<double>(log.samples()));
    for (double& y : log.tau.col(j)) y += sd * normal(random);
  }
  TorqueChannel Seen() const { return SeeChannel(arm.model(), {&log}); }
};

constexpr std::array kTimes{0.0, 0.01, 0.03, 0.04, 0.2, 1.0};

TEST(Channel, ARampThroughALowPass_IsLateByItsTimeConstant) {
  const VectorXd t = VectorXd::Map(kTimes.data(), 6);
  const VectorXd y = ThroughChannel(t, t, {0.05, 0, 1});
  for (Index k = 0; k < t.size(); ++k) EXPECT_NEAR(y[k], t[k] - 0.05 * (1 - std::exp(-t[k] / 0.05)), 1e-12);
  const VectorXd late = ThroughChannel(t, t, {0, 0.02, 1});
  for (Index k = 1; k < t.size(); ++k) EXPECT_NEAR(late[k], std::max(0.0, t[k] - 0.02), 1e-12);
}

TEST(Channel, LowPassesAndDelaysOfTheirOwn_AreFoundOnEveryJoint) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 0.02 + 0.01 * j, 0.004 * (j % 3));
  const TorqueChannel seen = a.Seen();
  ASSERT_FALSE(seen.empty());
  for (int j = 0; j < 6; ++j) {
    const JointChannel& own = seen[static_cast<std::size_t>(j)];
    EXPECT_EQ(own.lags, 1) << j;
    EXPECT_NEAR(own.lag_s, 0.02 + 0.01 * j, 0.15 * (0.02 + 0.01 * j)) << j;
    EXPECT_NEAR(own.late_s, 0.004 * (j % 3), 0.004) << j;
  }
}

TEST(Channel, TwoEqualLowPasses_AreToldFromOneWithADelay) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 0.03 + 0.004 * j, 0.005, 2);
  const TorqueChannel seen = a.Seen();
  ASSERT_FALSE(seen.empty());
  for (int j = 0; j < 6; ++j) {
    const JointChannel& own = seen[static_cast<std::size_t>(j)];
    EXPECT_EQ(own.lags, 2) << j;
    // Slow motion shows the sum of lags and delay well, and how the sum is shared less well.
    EXPECT_NEAR(2 * own.lag_s + own.late_s, 2 * (0.03 + 0.004 * j) + 0.005, 0.003) << j;
    EXPECT_NEAR(own.lag_s, 0.03 + 0.004 * j, 0.2 * (0.03 + 0.004 * j)) << j;
  }
}

// The sum of lags and delay is near that of 0.032 s twice without delay, where a search begins.
TEST(Channel, ALongDelayBehindTwoLowPasses_IsFound) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 0.0215, 0.02, 2);
  const TorqueChannel seen = a.Seen();
  ASSERT_FALSE(seen.empty());
  for (const JointChannel& own : seen) {
    EXPECT_EQ(own.lags, 2);
    EXPECT_NEAR(own.lag_s, 0.0215, 0.002);
    EXPECT_NEAR(own.late_s, 0.02, 0.004);
  }
}

// In noise no joint is sure of a short low-pass; all together are.
TEST(Channel, AShortLowPassThatEachJointShowsALittle_IsFoundOnEach) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 0.008, 0.01, 2), a.Disturb(j, 0.1);
  const TorqueChannel seen = a.Seen();
  ASSERT_FALSE(seen.empty());
  for (const JointChannel& own : seen) {
    EXPECT_GT(own.lag_s, 0.004);
    EXPECT_NEAR(own.lags * own.lag_s + own.late_s, 0.026, 0.005);
  }
}

// Where most joints are late, a joint that shows its delay less clearly is late, too.
TEST(Channel, ADelayOfOneNoisyJointAmongLateOnes_IsFound) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 1e-6, 0.012 + 0.004 * j);
  a.Disturb(2, 0.3);
  const TorqueChannel seen = a.Seen();
  ASSERT_FALSE(seen.empty());
  EXPECT_NEAR(seen[2].late_s, 0.02, 0.006);
}

TEST(Channel, TorqueAsItIs_HasNone) { EXPECT_TRUE(Arm().Seen().empty()); }

TEST(Channel, OneJointAlone_MayHaveAnotherCause) {
  Arm a;
  a.Measure(1, 0.04, 0.01);
  EXPECT_TRUE(a.Seen().empty());
}

TEST(Channel, ADelayThatAllJointsShare_IsLeftToTheSearch) {
  Arm a;
  for (int j = 0; j < 6; ++j) a.Measure(j, 1e-6, 0.008);
  EXPECT_TRUE(a.Seen().empty());
}

TEST(Channel, AFitThroughTheChannel_GivesTheParametersOfTheTorqueBeforeIt) {
  Arm plain, late;
  for (int j = 0; j < 6; ++j) late.Measure(j, 0.03, 0.005);
  const Fit truth = WeightedFit(plain.arm.model(), {&plain.log});
  const Fit ignored = WeightedFit(late.arm.model(), {&late.log});
  late.log.channel = late.Seen();
  const Fit fit = WeightedFit(late.arm.model(), {&late.log});
  int viscous = 0;
  for (int c = 0; c < plain.arm.model().front(); ++c) {
    if (!plain.arm.model().column_name(c).starts_with("Fv")) continue;
    ++viscous;
    EXPECT_LT(std::abs(fit.x[c] - truth.x[c]), 0.5 * std::abs(ignored.x[c] - truth.x[c]) + 2 * truth.sd[c])
        << plain.arm.model().column_name(c);
  }
  EXPECT_EQ(viscous, 6);
}

// Rows from 0.18 s on show what the joint did from 0.15 s on, when it rested. The step is 8 ms.
TEST(Channel, ARowThatShowsARest_IsNotUsed) {
  Arm a;
  a.log.used.setOnes(), a.log.moving.setOnes();
  const auto rests = [](double t) { return t > 0.15 && t < 0.25; };
  for (Index k = 0; k < a.log.samples(); ++k) a.log.moving(k, 2) = !rests(a.log.s.t[k]);
  a.log.channel.assign(6, {});
  a.log.channel[2].late_s = 0.03;
  UseWhatMoved(a.log);
  for (Index k = 0; k < a.log.samples(); ++k) {
    const double t = a.log.s.t[k];
    if (t > 0.18 && t < 0.28) {
      EXPECT_EQ(a.log.used(k, 2), 0) << t;
    } else if (t < 0.16 || t > 0.30) {
      EXPECT_EQ(a.log.used(k, 2), 1) << t;
    }
  }
  EXPECT_EQ(a.log.used.sum() + a.log.samples() - a.log.used.col(2).sum(), 6 * a.log.samples());  // no other joint's
}

}  // namespace
}  // namespace armcal::calibration
