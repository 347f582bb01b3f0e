// excitation tests - whole trajectories: rest, limits, smoothness, and what the slow part contains.
#include "host_sim/identify/excitation/compose.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/excitation/arms.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::excitation {
namespace {

using Eigen::VectorXd;

Composed OfPublishedSeries(const Observation& observation, const ComposeSettings& settings) {
  Series series = test::PublishedSeries();
  EXPECT_TRUE(ScaleToLimits(observation, 1 - settings.margin, series));
  return Compose(observation, series, settings);
}

class ComposeTest : public testing::Test {
 protected:
  const codegen::Model model_ = test::Arm(test::RobotFile("er20_like"));
  const Observation observation_{model_};
};

TEST_F(ComposeTest, StartsAndEndsAtRestInOnePose) {
  for (const int speeds : {0, 2}) {
    const Composed c = OfPublishedSeries(observation_, {1, speeds, 0.004, 0.05});
    const auto& q = c.trajectory.q;
    const Eigen::Index last = q.rows() - 1;
    EXPECT_LT((q.row(0) - q.row(last)).cwiseAbs().maxCoeff(), 1e-12);
    // A quintic leaves rest as jerk t^3 / 6: a few 1e-6 rad after 4 ms; with a speed of 0.01 rad/s it would be 4e-5.
    EXPECT_LT((q.row(1) - q.row(0)).cwiseAbs().maxCoeff(), 2e-5);
    EXPECT_LT((q.row(last) - q.row(last - 1)).cwiseAbs().maxCoeff(), 2e-5);
  }
}

TEST_F(ComposeTest, KeepsLimitsOnTheCheckGrid_AsReported) {
  const Composed c = OfPublishedSeries(observation_, {1, 6, 0.004, 0.1});
  const trajectory::TrajectorySpline spline(c.trajectory);
  for (int j = 0; j < 6; ++j) {
    const codegen::Joint& joint = model_.robot().joint[j];
    double lowest = INFINITY, highest = -INFINITY, speed = 0, acceleration = 0;
    for (double t = 0; t <= spline.duration_s(); t += 0.001) {
      const double q = spline.Position(t)[j];
      lowest = std::min(lowest, q), highest = std::max(highest, q);
      speed = std::max(speed, std::abs(spline.Speed(t)[j]));
      acceleration = std::max(acceleration, std::abs(spline.Acceleration(t)[j]));
    }
    EXPECT_GT(lowest, joint.position_limit_rad[0]);
    EXPECT_LT(highest, joint.position_limit_rad[1]);
    EXPECT_LE(speed, 0.905 * joint.speed_limit_radps);
    EXPECT_LE(acceleration, 0.91 * joint.acceleration_limit_radps2);
    EXPECT_NEAR(c.peaks[j].speed_radps, speed, 1e-6 * speed);
    EXPECT_NEAR(c.peaks[j].acceleration_radps2, acceleration, 1e-3 * acceleration);
    EXPECT_LE(c.peaks[j].torque_share, 0.91);
  }
}

TEST_F(ComposeTest, HasNoJumpInAccelerationAnywhere) {
  const Composed c = OfPublishedSeries(observation_, {1, 2, 0.004, 0.05});
  const trajectory::TrajectorySpline spline(c.trajectory);
  VectorXd before = spline.Acceleration(0);
  for (double t = 0.004; t < spline.duration_s(); t += 0.004) {
    const VectorXd here = spline.Acceleration(t);
    for (int j = 0; j < 6; ++j)  // the shortest blends go from zero to the limit within 0.05 s
      EXPECT_LT(std::abs(here[j] - before[j]), 0.15 * model_.robot().joint[j].acceleration_limit_radps2) << "t " << t;
    before = here;
  }
}

TEST_F(ComposeTest, SectionsFollowOneAnother_AndTheSeriesLastsItsPeriods) {
  const Composed c = OfPublishedSeries(observation_, {3, 2, 0.004, 0.05});
  EXPECT_EQ(c.sections.front().begin_s, 0);
  for (std::size_t k = 1; k < c.sections.size(); ++k) EXPECT_EQ(c.sections[k].begin_s, c.sections[k - 1].end_s);
  EXPECT_NEAR(c.sections.back().end_s, c.trajectory.duration_s(), 0.004);
  ASSERT_EQ(c.sections[1].name, "fourier");
  EXPECT_NEAR(c.sections[1].end_s - c.sections[1].begin_s, 30, 1e-9);
}

TEST_F(ComposeTest, SlowPart_MovesEveryJointBothWaysSlowlyForSeconds) {
  const Composed c = OfPublishedSeries(observation_, {1, 6, 0.004, 0.05});
  const trajectory::TrajectorySpline spline(c.trajectory);
  const auto slow =
      std::find_if(c.sections.begin(), c.sections.end(), [](const Section& s) { return s.name == "slow moves"; });
  ASSERT_NE(slow, c.sections.end());
  EXPECT_GT(slow->end_s - slow->begin_s, 20);
  EXPECT_LT(slow->end_s - slow->begin_s, 30);
  for (int j = 0; j < 6; ++j) {
    const double v_min = model_.robot().joint[j].v_min_radps;
    double forward = 0, backward = 0;
    int reversals = 0;
    double sign = 0;
    for (double t = slow->begin_s; t < slow->end_s; t += 0.004) {
      const double v = spline.Speed(t)[j];
      if (v > 2 * v_min && v < 20 * v_min) forward += 0.004;
      if (v < -2 * v_min && v > -20 * v_min) backward += 0.004;
      if (std::abs(v) > v_min && v * sign <= 0) ++reversals, sign = v;
    }
    EXPECT_GT(forward, 3) << "joint " << j + 1;
    EXPECT_GT(backward, 3) << "joint " << j + 1;
    EXPECT_GE(reversals, 12) << "joint " << j + 1;
  }
}

TEST_F(ComposeTest, WhereTorqueLeavesNoRoomForASlowPart_SaysSo) {
  codegen::Robot robot = test::RobotFile("er20_like");
  robot.joint[5].torque_limit_Nm = 8.2;  // above its Coulomb friction of 8 N m by less than the margin
  const codegen::Model weak = test::Arm(robot);
  const Observation observation(weak);
  const std::string error = files::test::ErrorOf([&] { Compose(observation, test::PublishedSeries(), {}); });
  EXPECT_NE(error.find("er20_like.toml"), std::string::npos);
  EXPECT_NE(error.find("limits"), std::string::npos);
}

TEST(SlowMoves, StayInRangeFromAPoseNearALimit_AndReturnHomeAfterEveryCell) {
  const codegen::Robot robot = test::RobotFile("er20_like");
  VectorXd home(6);
  for (int j = 0; j < 6; ++j) home[j] = 0.9 * robot.joint[j].position_limit_rad[j % 2];
  const SlowMoves moves(robot, home, 6, 0.95, 1);
  for (double t = 0; t <= moves.duration_s(); t += 0.01) {
    const VectorXd q = moves.Position(t);
    for (int j = 0; j < 6; ++j) {
      EXPECT_GE(q[j], robot.joint[j].position_limit_rad[0]);
      EXPECT_LE(q[j], robot.joint[j].position_limit_rad[1]);
    }
  }
  for (int cell = 0; cell <= 7; ++cell) EXPECT_LT((moves.Position(moves.duration_s() * cell / 7) - home).norm(), 1e-12);
}

TEST(Strokes, BetweenBlends_RunAtConstantSpeedBothWays) {
  const Strokes strokes(3.5, 2, 0.4, 0.3);
  const auto speed = [&](double t) { return (strokes.Offset(t + 1e-5) - strokes.Offset(t - 1e-5)) / 2e-5; };
  for (double t = 0.31; t < 1.59; t += 0.1) EXPECT_NEAR(speed(t), 0.4, 1e-9);
  for (double t = 1.91; t < 3.19; t += 0.1) EXPECT_NEAR(speed(t), -0.4, 1e-9);
  // Numerically: how far the speed carries from rest.
  double farthest = 0;
  for (double t = 0; t < 3.5; t += 1e-3) farthest = std::max(farthest, strokes.Offset(t));
  EXPECT_NEAR(strokes.reach_rad(), farthest, 1e-6);
  EXPECT_NEAR(strokes.Offset(3.5), 0, 1e-15);
}

TEST(ShortestBlend, BetweenPosesAtTheEdgeOfTheirShare_IsFoundDespiteRoundOff) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  for (double share = 0.5; share < 1; share += 0.037) {
    VectorXd low(2), high(2);
    for (int j = 0; j < 2; ++j) {
      const auto limit = model.robot().joint[j].position_limit_rad;
      low[j] = share * limit[0], high[j] = share * limit[1];
    }
    EXPECT_TRUE(ShortestBlend(observation, AtRest(low), AtRest(high), share)) << share;
    EXPECT_TRUE(ShortestBlend(observation, AtRest(high), AtRest(low), share)) << share;
  }
}

TEST(Blend, MeetsPositionSpeedAndAccelerationAtBothEnds) {
  const State from{VectorXd::Constant(1, 0.3), VectorXd::Constant(1, -1.0), VectorXd::Constant(1, 2.0)};
  const State to{VectorXd::Constant(1, -0.7), VectorXd::Constant(1, 0.5), VectorXd::Constant(1, -3.0)};
  const Blend blend(from, to, 1.7);
  VectorXd ends(2);
  ends << 0, 1.7;
  const codegen::Signals s = blend.At(ends);
  const State* const end[] = {&from, &to};
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(s.q(k, 0), end[k]->q[0], 1e-13);
    EXPECT_NEAR(s.qd(k, 0), end[k]->qd[0], 1e-13);
    EXPECT_NEAR(s.qdd(k, 0), end[k]->qdd[0], 1e-12);
    EXPECT_NEAR(blend.Position(ends[k])[0], end[k]->q[0], 1e-13);
  }
  const double d = 1e-5;
  const auto near = blend.At(VectorXd::LinSpaced(3, 0.8 - d, 0.8 + d));
  EXPECT_NEAR((near.q(2, 0) - near.q(0, 0)) / (2 * d), near.qd(1, 0), 1e-8);
  EXPECT_NEAR((near.qd(2, 0) - near.qd(0, 0)) / (2 * d), near.qdd(1, 0), 1e-8);
}

}  // namespace
}  // namespace armcal::excitation
