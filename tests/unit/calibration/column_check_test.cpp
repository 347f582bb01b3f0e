// calibration tests - changes of columns that no fit can see are those of a mirrored or turned arm, and no others.
#include "host_sim/identify/calibration/column_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/column_fit.hpp"
#include "host_sim/identify/calibration/untold.hpp"
#include "tests/unit/calibration/measured_arms.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using tests::SyntheticArm;

bool Contains(const std::vector<std::string>& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

std::vector<std::string> UntoldOf(const std::string& robot) {
  return UntoldFaults(codegen::Model(codegen::ReadRobot("codegen/robots/" + robot + ".toml"), tests::Records()));
}

// An arm whose axes 2, 3 and 5 are perpendicular to one plane, with wrist and shoulder in it, has a mirror image: axes
// 1, 4 and 6 turn the other way. Sideways steps of the shoulder and wrist (UR10) leave none.
TEST(Untold, MirroredArm_OnlyWhereTheKinematicsHaveAPlane) {
  const std::vector<std::string> kr300 = UntoldOf("kuka_kr300"), ur10 = UntoldOf("ur10");
  EXPECT_TRUE(Contains(kr300, "the signs of q1, q4, q6 with tau1, tau4, tau6"));
  for (const std::string& fault : ur10) EXPECT_EQ(fault.find("sign"), std::string::npos) << fault;
  for (const auto& list : {kr300, ur10}) {
    EXPECT_TRUE(Contains(list, "an offset of q1 or q6"));  // about gravity, and of the last body
    EXPECT_TRUE(Contains(list, "one factor of all torques"));
    EXPECT_FALSE(Contains(list, "the unit of time"));
  }
}

// One mass with friction: every unit and sign is another mass.
TEST(Untold, OneSlidingMass_HidesEverything) {
  const std::vector<std::string> emps = UntoldOf("emps");
  for (const char* fault : {"an offset of q1", "a factor of tau1", "the sign of q1 with tau1", "the unit of time"})
    EXPECT_TRUE(Contains(emps, fault)) << fault;
}

TEST(Untold, WithLinkData_IsEmpty) { EXPECT_TRUE(UntoldOf("er20_like").empty()); }

class ColumnCheck : public testing::Test {
 protected:
  static codegen::Robot Free() {
    codegen::Robot robot = tests::Er20();
    robot.has_prior = false;
    return robot;
  }
  SyntheticArm arm_{tests::Er20(), 3};
  codegen::Model free_{Free(), tests::Records()};
};

// The torque of KDL at one motion, read at another: what untold.hpp says cannot be seen leaves the fit unchanged.
TEST_F(ColumnCheck, AnOffsetOfTheFirstJoint_LeavesTheFitAsItIs) {
  Dataset d = arm_.Run(15, 1);
  const auto left = [&] {
    const ColumnFit fit(free_, {&d}, 600);
    const ColumnChange given(6);
    return fit.Fit(fit.Move(given), given).log_left;
  };
  const double before = left();
  d.s.q.col(0).array() += 0.3;
  EXPECT_NEAR(left(), before, 0.05);  // the ridge alone differs
}

// A log whose clock runs at half the speed shows sin(3 t) where the arm moves by sin(6 u), u being true time.
TEST(ColumnChange, OfTheUnitOfTime_GivesTheDerivativesByTrueTime) {
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(20, 0, 2), u = t / 2;
  codegen::Signals log;
  log.t = t;
  log.q.resize(20, 2), log.qd.resize(20, 2), log.qdd.resize(20, 2);
  log.q << (3 * t).sin(), t.sin();
  log.qd << 3 * (3 * t).cos(), t.cos();
  log.qdd << -9 * (3 * t).sin(), -t.sin();
  ColumnChange change(2);
  change.pace = 2;
  change.q = {1, 0}, change.q_scale = {1, -1};
  const codegen::Signals moved = change.Moved(log);
  EXPECT_LT((moved.q.col(1).array() + (6 * u).sin()).abs().maxCoeff(), 1e-12);
  EXPECT_LT((moved.qd.col(1).array() + 6 * (6 * u).cos()).abs().maxCoeff(), 1e-12);
  EXPECT_LT((moved.qdd.col(1).array() - 36 * (6 * u).sin()).abs().maxCoeff(), 1e-12);
  EXPECT_LT((moved.qdd.col(0).array() + 4 * (2 * u).sin()).abs().maxCoeff(), 1e-12);
}

TEST_F(ColumnCheck, GoodLogs_GainNothing) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const Dataset d = arm_.Run(12, seed, {}, seed > 2 ? 0.1 : 0.5);
    EXPECT_LT(BestColumnChange(free_, {&d}).gain, 0.5) << seed;
    EXPECT_TRUE(CheckColumns(free_, {&d}).empty()) << seed;
  }
}

TEST_F(ColumnCheck, AModelThatExplainsNothingOfAJoint_IsSaid) {
  Dataset d = arm_.Run(15, 2);
  for (Eigen::Index k = 0; k < d.tau.rows(); ++k) d.tau(k, 4) = 40 * std::sin(7.7 * d.s.t[k]);
  const std::vector<std::string> notes = CheckColumns(free_, {&d});
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("joint 5: the model explains nothing"), std::string::npos) << notes[0];
}

}  // namespace
}  // namespace armcal::calibration
