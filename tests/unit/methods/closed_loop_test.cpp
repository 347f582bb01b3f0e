// methods tests - the simulated closed loop obeys KDL's dynamics, tracks, sticks, and reports when it fails.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "tests/unit/methods/better_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::SyntheticArm;

// Largest |tau - KDL - friction| over samples whose joints keep moving one way, in shares of each joint's torque limit.
double WorstImbalance(const SyntheticArm& arm, const VectorXd& bodies, const LoopRun& run) {
  const codegen::Robot& robot = arm.model().robot();
  tests::KdlArm kdl(robot, bodies);
  double worst = 0;
  for (int k = 3; k + 3 < run.s.samples(); ++k) {
    bool steady = true;
    for (int j = 0; j < robot.joints(); ++j)
      for (int m = k - 2; m <= k + 2; ++m)
        steady = steady && run.s.qd(m, j) * run.s.qd(k, j) > 0 && std::abs(run.s.qd(m, j)) > robot.joint[j].v_min_radps;
    if (!steady) continue;
    const VectorXd rigid = kdl.Torque(run.s.q.row(k), run.s.qd.row(k), run.s.qdd.row(k));
    for (int j = 0; j < robot.joints(); ++j) {
      const double qd = run.s.qd(k, j);
      const double tau = rigid[j] + arm.Friction("Fc", j) * (qd > 0 ? 1 : -1) + arm.Friction("Fv", j) * qd;
      worst = std::max(worst, std::abs(run.tau(k, j) - tau) / robot.joint[j].torque_limit_Nm);
    }
  }
  return worst;
}

TEST(ClosedLoop, Motion_ObeysKdlsDynamicsOfTheGivenBodies) {
  SyntheticArm arm(tests::ExactGains("er20_like"), 3);
  const Dataset reference = arm.Run(10, 4);
  LoopSimulator loop(arm.model());
  const LoopRun run = loop.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  ASSERT_TRUE(run.complete);
  // Viscous friction is taken at a step's start: beta x qdd x 0.25 ms is 0.1 N m of 1500.
  EXPECT_LT(WorstImbalance(arm, arm.bodies(), run), 2e-3);
  EXPECT_LT((run.s.q - reference.s.q).cwiseAbs().maxCoeff(), 0.01);  // the gains hold a 20 % error of the feed-forward
  VectorXd other = arm.bodies();
  other[12] *= 1.2;  // planted: link 2's m c_x, 23 N m of gravity
  EXPECT_GT(WorstImbalance(arm, other, run), 5e-3);
}

TEST(ClosedLoop, AnArmWithoutRotors_NeitherChattersNorRunsAway) {
  codegen::Robot robot = tests::ExactGains("er20_like");
  for (auto& j : robot.joint) j.motor.rotor_inertia_kgm2 = 0;
  SyntheticArm arm(robot, 3);
  const Dataset reference = arm.Run(10, 4);
  LoopSimulator loop(arm.model());
  const LoopRun run = loop.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  ASSERT_TRUE(run.complete);
  EXPECT_LT((run.s.q - reference.s.q).cwiseAbs().maxCoeff(), 0.01);
  // Chatter would show as turns that the reference does not make. At a turn a joint may stop and break loose again.
  const auto turns = [](const VectorXd& speed) {
    int count = 0;
    for (Eigen::Index k = 1; k < speed.size(); ++k)
      count += speed[k] * speed[k - 1] < 0 || (speed[k] != 0 && speed[k - 1] == 0);
    return count;
  };
  for (int j = 0; j < 6; ++j) EXPECT_LE(turns(run.s.qd.col(j)), turns(reference.s.qd.col(j)) + 2) << j;
  EXPECT_LT(WorstImbalance(arm, arm.bodies(), run), 2e-3);
}

TEST(ClosedLoop, AJointWhoseFrictionCanHoldIt_StaysAtRest) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 1);
  const VectorXd t = VectorXd::LinSpaced(200, 0, 1.592);
  MatrixXd reference(200, 2);
  reference.col(0).setConstant(-std::numbers::pi / 2), reference.col(1).setConstant(0);  // hangs down
  LoopSimulator loop(arm.model());
  const LoopRun run = loop.Run(t, reference, tests::Truth(arm));
  ASSERT_TRUE(run.complete);
  EXPECT_LT(run.s.qd.cwiseAbs().maxCoeff(), 1e-9);  // the spline's rounding in the first sample's speed
  EXPECT_EQ(run.s.qd.bottomRows(190).cwiseAbs().maxCoeff(), 0);
}

TEST(ClosedLoop, TheControllersBelief_ChangesTheMotionLittleAndTheTorqueLess) {
  SyntheticArm arm(tests::TwoLinkWithControl(), 1);
  const Dataset reference = arm.Run(5, 2);
  LoopSettings knowing{tests::Truth(arm), false};
  LoopSimulator believed(arm.model()), known(arm.model(), knowing);
  const LoopRun a = believed.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  const LoopRun b = known.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  EXPECT_LT((b.s.q - reference.s.q).norm(), (a.s.q - reference.s.q).norm());  // who knows the arm tracks better
  EXPECT_GT((a.s.q - b.s.q).norm(), 0);
}

TEST(ClosedLoop, EncoderSteps_ReachTheReadingAndStaySmallInTheMotion) {
  codegen::Robot robot = tests::TwoLinkWithControl();
  SyntheticArm arm(robot, 1);
  const Dataset reference = arm.Run(5, 2);
  LoopSimulator smooth(arm.model()), stepped(arm.model(), {{}, true});
  const LoopRun a = smooth.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  const LoopRun b = stepped.Run(reference.s.t, reference.s.q, tests::Truth(arm));
  const double step = 2 * std::numbers::pi / (robot.joint[0].motor.counts_per_turn * robot.joint[0].motor.gear_ratio);
  EXPECT_LE((b.q_read.col(0) - b.s.q.col(0)).cwiseAbs().maxCoeff(), 0.5001 * step);
  EXPECT_LT((a.s.q - b.s.q).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_GT((a.s.q - b.s.q).cwiseAbs().maxCoeff(), 0);
}

TEST(ClosedLoop, WithoutAControlLawOrAReference_IsRefused) {
  SyntheticArm arm(tests::ExactGains("two_link"), 1);
  EXPECT_THROW(LoopSimulator loop(arm.model()), io::InputError);
  SyntheticArm controlled(tests::TwoLinkWithControl(), 1);
  const Dataset d = controlled.Run(2, 2);
  const ClosedLoop loop = MakeClosedLoop(controlled.model());
  EXPECT_THROW(loop(d, tests::Truth(controlled)), io::InputError);
  const Problem without = MakeProblem(controlled.model(), {&d});
  EXPECT_THROW(InstrumentalVariable(without), io::InputError);
  EXPECT_THROW(Didim(without), io::InputError);
}

}  // namespace
}  // namespace armcal::calibration
