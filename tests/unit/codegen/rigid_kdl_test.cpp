// tests - the rigid regressor in base coordinates against KDL: every robot here, any chain, any gravity.
#include <gtest/gtest.h>

#include "tests/unit/codegen/checked_in.hpp"
#include "tests/unit/codegen/rigid_oracle.hpp"

namespace armcal::tests {
namespace {

class CheckedInRobot : public testing::TestWithParam<const char*> {};

TEST_P(CheckedInRobot, BaseRegressor_OverTenThousandStates_EqualsKdl) {
  const codegen::Robot robot = Read(GetParam());
  const GraphArm arm(robot);
  EXPECT_LT(ErrorAgainstKdl(robot, arm.Torque(), 10000, 1), kTolerance);
}

TEST_P(CheckedInRobot, AllColumns_OfTheStandardSet_EqualKdl) {
  codegen::Robot robot = Read(GetParam());
  robot.parameters = {true, {}, {}};
  const GraphArm arm(robot);
  EXPECT_LT(ErrorAgainstKdl(robot, arm.Torque(), 1000, 2), kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Robots, CheckedInRobot,
                         testing::Values("er20_like", "puma560", "ur10", "kuka_kr300", "kuka_lwr4", "emps",
                                         "two_link"));

TEST(RandomChains, OfOneToSevenMixedJointsInAnyGravity_EqualKdl) {
  std::mt19937_64 random(7);
  for (int n = 1; n <= 7; ++n)
    for (int trial = 0; trial < (n < 5 ? 12 : 4); ++trial) {
      const codegen::Robot robot = RandomArm(n, random);
      const GraphArm arm(robot);
      // The merge coefficients of random lengths reach some hundreds; so does the amplified round-off.
      EXPECT_LT(ErrorAgainstKdl(robot, arm.Torque(), 200, 3), 100 * kTolerance) << n << " joints, trial " << trial;
    }
}

TEST(Gravity, InAnyDirectionOfATurnedBase_EqualsKdl) {
  codegen::Robot robot = Read("ur10");
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> u(-M_PI, M_PI);
  for (int trial = 0; trial < 5; ++trial) {
    const auto direction = [&] { return Eigen::Vector3d(u(random), u(random), u(random)).normalized(); };
    const Eigen::Vector3d g = direction() * 9.81;
    robot.gravity_mps2 = {g[0], g[1], g[2]};
    const Eigen::Matrix3d R = Eigen::AngleAxisd(u(random), direction()).toRotationMatrix();
    for (int k = 0; k < 9; ++k) robot.base_rotation[k] = R(k / 3, k % 3);
    const GraphArm arm(robot);
    EXPECT_EQ(arm.base().column.size(), 42u);  // a tilted base makes mx1 and my1 visible
    EXPECT_LT(ErrorAgainstKdl(robot, arm.Torque(), 500, 4), kTolerance);
  }
}

// Where dot products are taken must change the count alone.
TEST(FrameChoice, AnyAxes_GiveTheSameTorque) {
  const codegen::Robot robot = Read("puma560");
  std::mt19937_64 random(9);
  codegen::FrameChoice choice = codegen::BestFrames(robot);
  const int n = robot.joints();
  for (int trial = 0; trial < 20; ++trial) {
    for (int j = 0; j < n; ++j) {
      choice.lumped[j] = random() % 2;
      for (int i = 0; i <= j; ++i)
        for (int& half : choice.axes[i * n + j]) half = 2 * i + static_cast<int>(random() % (2 * (j - i) + 2));
    }
    codegen::Graph graph;
    const auto rows = codegen::BodyRegressor(graph, robot, true, choice);
    std::vector<codegen::Expr> roots;
    for (const auto& row : rows) roots.insert(roots.end(), row.begin(), row.end());
    const codegen::Tape tape(graph, roots);
    const MatrixXd slide = codegen::SlideMap(robot);
    const TorqueOf torque = [&](const State& s, const std::vector<Body>& bodies) -> VectorXd {
      const auto values = tape.EvaluateAt<double>(InputValues(graph, s));
      return Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(values.data(), n, 11 * n) *
             (slide * StandardParameters(bodies));
    };
    EXPECT_LT(ErrorAgainstKdl(robot, torque, 50, 5), kTolerance) << "trial " << trial;
  }
}

}  // namespace
}  // namespace armcal::tests
