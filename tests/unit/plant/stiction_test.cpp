// plant - tests that resting joints rest, break loose at their level, and stop without a residue.
#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

// A slide on a 30 degree slope: z of the base frame is turned, so that gravity pulls it with m g / 2 = 14.715 N.
constexpr double kPull_N = 3.0 * 9.81 * 0.5;
std::string Slope(double coulomb, double viscous = 0) {
  return WriteText("slope.toml", RobotText({{.type = "prismatic", .coulomb = coulomb, .viscous = viscous}},
                                           "dh = \"modified\"\nbase_frame = { rpy_deg = [60, 0, 0] }\n"));
}

TEST(RestingJoint, OnASlopeBelowItsBreakawayLevel_DoesNotCreepIn60s) {
  Arm arm(MakeScenario("start_rad = [0.123]\n"), Slope(kPull_N * 1.001));
  Sensors sensors;
  for (int k = 0; k < 60000; ++k) arm.Step(std::vector<double>{0.0}, sensors);
  EXPECT_EQ(arm.q()[0], 0.123);  // exactly: a resting joint is a constraint, not a stiff spring
  EXPECT_EQ(arm.qd()[0], 0.0);
  EXPECT_NEAR(arm.friction_torque_Nm()[0], -kPull_N, 1e-9);  // friction holds the slide's weight
}

TEST(RestingJoint, OnASteeperSlope_SlidesDownWithTheDifference) {
  Arm arm(MakeScenario(), Slope(kPull_N * 0.9));
  Sensors sensors;
  for (int k = 0; k < 200; ++k) arm.Step(std::vector<double>{0.0}, sensors);
  const double mass = 3.0 + 100 * 100 * 2e-5;  // with the rotor
  EXPECT_NEAR(arm.qd()[0], -0.2 * 0.1 * kPull_N / mass, 1e-9);
}

TEST(RestingJoint, UnderARisingPush_BreaksLooseAtTheBreakawayLevelAndNotBefore) {
  for (const double stick_ratio : {1.0, 1.3}) {
    Arm arm(MakeScenario("stick_ratio = " + std::to_string(stick_ratio) + "\n"), Slope(40.0));
    Sensors sensors;
    double push = 0;
    while (arm.at_rest(0) && push < 200) {
      push += 0.002;  // N a tick: the 1 ms lag of the current is then 0.002 N
      arm.Step(std::vector<double>{CurrentFor(arm, 0, push)}, sensors);
    }
    EXPECT_NEAR(arm.torque_Nm()[0], kPull_N + stick_ratio * 40.0, 0.005) << stick_ratio;
  }
}

TEST(MovingJoint, WithoutDrive_StopsWhereItsEnergyIsUsedUpAndNeverTurnsBack) {
  Arm arm(MakeScenario(),
          WriteText("flat.toml", RobotText({{.type = "prismatic", .coulomb = 25}},
                                           "dh = \"modified\"\nbase_frame = { rpy_deg = [90, 0, 0] }\n")));
  Sensors sensors;
  for (int k = 0; k < 100; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, 60)}, sensors);
  for (int k = 0; k < 30; ++k) arm.Step(std::vector<double>{0.0}, sensors);  // the current is gone: e^-30
  const double q0 = arm.q()[0], v0 = arm.qd()[0], mass = 3.2;
  ASSERT_GT(v0, 0.3);
  for (int k = 0; k < 2000; ++k) {
    arm.Step(std::vector<double>{0.0}, sensors);
    ASSERT_GE(arm.qd()[0], 0.0);
  }
  EXPECT_TRUE(arm.at_rest(0));
  EXPECT_NEAR(arm.q()[0] - q0, v0 * v0 * mass / (2 * 25), 1e-9);
}

TEST(TwoJoints, HeldByFrictionUnderChatteringCurrent_BothStay) {
  std::vector<JointText> joints{{.alpha_deg = -90, .coulomb = 40}, {.a_m = 0.4, .coulomb = 20}};
  Arm arm(MakeScenario("start_rad = [0.9, 0.5]\n"), WriteText("two.toml", RobotText(joints)));
  const Eigen::VectorXd start = arm.q();
  const Eigen::VectorXd weight = arm.friction_torque_Nm();  // resting without current: minus the weight
  Sensors sensors;
  for (int k = 0; k < 5000; ++k) {
    std::vector<double> current(2);
    for (int j = 0; j < 2; ++j)
      current[static_cast<std::size_t>(j)] = CurrentFor(arm, j, -weight[j] + (k % 2 ? 9 : -9));
    arm.Step(current, sensors);
  }
  EXPECT_EQ((arm.q() - start).norm(), 0.0);
}

// A push on joint 1 alone: joint 2 has to be carried along by its own friction, until the inertial load exceeds it.
TEST(TwoJoints, WhenOneAccelerates_TheOtherStaysFixedToItUntilItsLevel) {
  std::vector<JointText> joints{{.coulomb = 5}, {.a_m = 0.4, .coulomb = 8}};  // both axes vertical: no weight
  Arm arm(MakeScenario(), WriteText("two.toml", RobotText(joints)));
  Sensors sensors;
  bool rested = false, came_loose = false;
  for (int k = 0; k < 400; ++k) {
    arm.Step(std::vector<double>{CurrentFor(arm, 0, 0.3 * k), 0.0}, sensors);
    rested = rested || (!arm.at_rest(0) && arm.at_rest(1));
    came_loose = came_loose || !arm.at_rest(1);
    const bool held = arm.at_rest(1);
    EXPECT_TRUE(!held || std::abs(arm.friction_torque_Nm()[1]) <= 8 + 1e-9) << k;
  }
  EXPECT_TRUE(rested);
  EXPECT_TRUE(came_loose);
}

TEST(Brakes, WhenClosed_HoldAgainstGravityAndWhenOpened_LetGo) {
  Arm arm(MakeScenario(), Slope(0));
  Sensors sensors;
  arm.SetBrakes(true);
  for (int k = 0; k < 100; ++k) arm.Step(std::vector<double>{1.0}, sensors);
  EXPECT_EQ(arm.q()[0], 0.0);
  EXPECT_NEAR(arm.torque_Nm()[0], 50.0, 1e-9);  // the current flows all the same
  arm.SetBrakes(false);
  arm.Step(std::vector<double>{1.0}, sensors);
  EXPECT_GT(arm.qd()[0], 0.0);
}

}  // namespace
}  // namespace armcal::plant
