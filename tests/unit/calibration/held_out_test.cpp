// calibration tests - what a held-out log cannot tell: it is no other motion, it leaves what training has shown, or its
// joints move in phase.
#include <gtest/gtest.h>

#include "host_sim/identify/calibration/held_out.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using tests::SyntheticArm;

SyntheticArm TwoLink() { return SyntheticArm(codegen::ReadRobot("codegen/robots/two_link.toml"), 8); }

HeldOutMotion Compare(const SyntheticArm& arm, const Dataset& train, const Dataset& test) {
  return CompareMotion(arm.model(), WeightedFit(arm.model(), {&train}), {&train}, test);
}

// Rows `from` to `to` of a log, its clock begun anew.
Dataset Part(const Dataset& d, int from, int to) {
  const auto rows = Eigen::seq(from, to - 1);
  Dataset out = d;
  out.s.t = d.s.t(rows).array() - d.s.t[from];
  out.s.q = d.s.q(rows, Eigen::all), out.s.qd = d.s.qd(rows, Eigen::all), out.s.qdd = d.s.qdd(rows, Eigen::all);
  out.tau = d.tau(rows, Eigen::all), out.moving = d.moving(rows, Eigen::all), out.used = d.used(rows, Eigen::all);
  out.scored = d.scored(rows);
  return out;
}

TEST(HeldOutMotion, OfAnotherTrajectory_SaysNothing) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1), test = arm.Run(20, 2);
  const HeldOutMotion m = Compare(arm, train, test);
  EXPECT_FALSE(m.repeats());
  EXPECT_LT(m.trajectory.share, 0.1);
  EXPECT_TRUE(m.in_phase.empty());
}

TEST(HeldOutMotion, OfTheTrainingSamplesThemselves_IsSeen) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1);
  EXPECT_GT(Compare(arm, train, Part(train, 1000, 3000)).samples.share, 0.9);
}

// The same five harmonics with other noise, begun 3.7 s later: positions off by a controller's millirad.
TEST(HeldOutMotion, ThatRepeatsATrajectoryLater_IsSeen) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1);
  Dataset test = Part(train, 463, 2963);
  for (int k = 0; k < test.samples(); ++k) {
    test.s.q.row(k).array() += 1e-3 * std::sin(0.7 * k);
    test.tau.row(k).array() += 0.01 * std::cos(1.3 * k);
  }
  const HeldOutMotion m = Compare(arm, train, test);
  EXPECT_EQ(m.samples.share, 0);
  EXPECT_GT(m.trajectory.share, 0.9);
  EXPECT_TRUE(m.repeats());
}

// Faster by a tenth: the same path, and other speeds and loads.
TEST(HeldOutMotion, ThatRepeatsAPathAtAnotherSpeed_IsAnother) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1);
  Dataset test = train;
  test.s.t *= 0.9, test.s.qd /= 0.9, test.s.qdd /= 0.81;
  for (int k = 0; k < test.samples(); ++k) test.tau.row(k).array() += 0.01 * std::cos(1.3 * k);
  EXPECT_FALSE(Compare(arm, train, test).repeats());
}

TEST(HeldOutMotion, OutsideOfTheTrainingRange_IsExtrapolation) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1, {}, 0.2), test = arm.Run(20, 2, {}, 0.5);
  const HeldOutMotion m = Compare(arm, train, test), within = Compare(arm, test, train);
  for (int j = 0; j < 2; ++j) {
    EXPECT_TRUE(m.joint[j].beyond()) << j + 1;
    EXPECT_GT(m.joint[j].speed, 0.05) << j + 1;
    EXPECT_EQ(within.joint[j].speed, 0) << j + 1;
  }
}

// A joint that stood in training: the model knows nothing of its inertia, and the leverage says so.
TEST(HeldOutMotion, OfAJointThatStood_IsExtrapolation) {
  SyntheticArm arm = TwoLink();
  const Dataset train = arm.Run(40, 1, {}, 0.5, {1}), test = arm.Run(20, 2);
  EXPECT_GT(Compare(arm, train, test).joint[0].leverage, 4);
}

TEST(HeldOutMotion, NamesJointsThatMoveInPhase) {
  SyntheticArm arm = TwoLink();
  Dataset train = arm.Run(40, 1), test = arm.Run(20, 2);
  for (Eigen::MatrixXd* m : {&train.s.q, &train.s.qd, &train.s.qdd}) m->col(1) = -0.7 * m->col(0);
  const HeldOutMotion m = Compare(arm, train, test);
  ASSERT_EQ(m.in_phase.size(), 1u);
  EXPECT_EQ(m.in_phase[0].joints, (std::vector<int>{0, 1}));
  EXPECT_FALSE(m.in_phase[0].together);
}

}  // namespace
}  // namespace armcal::calibration
