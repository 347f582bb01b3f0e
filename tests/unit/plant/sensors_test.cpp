// plant - tests encoder, current and temperature readings.
#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

TEST(Encoder, RoundsToTheNearestStepWithSignAndZero) {
  constexpr double kTurn = 2 * std::numbers::pi;
  EXPECT_EQ(EncoderCounts(kTurn / 100, 100, 65536, 0), 65536);
  EXPECT_EQ(EncoderCounts(kTurn / 100, -100, 65536, 77), 77 - 65536);
  const double step = kTurn / (100 * 65536.0);
  EXPECT_EQ(EncoderCounts(0.49 * step, 100, 65536, 0), 0);
  EXPECT_EQ(EncoderCounts(0.51 * step, 100, 65536, 0), 1);
  EXPECT_EQ(EncoderCounts(-0.51 * step, 100, 65536, 0), -1);
}

TEST(Encoder, BeyondItsRange_WrapsLikeARegister) {
  EXPECT_EQ(EncoderCounts(0, 100, 65536, 2147483647), 2147483647);
  EXPECT_EQ(EncoderCounts(2 * std::numbers::pi / (100 * 65536.0), 100, 65536, 2147483647), -2147483647 - 1);
}

TEST(Arm, WithCoupledAxes_ReadsMotorPositionsAndSharesMotorTorque) {
  const std::string top = "dh = \"modified\"\ncoupling = { matrix = [1.0, 0.0, -0.5, 1.0] }\n";
  Arm arm(MakeScenario("start_rad = [0.2, 0.3]\n"),
          WriteText("coupled.toml", RobotText({{.gear = 100, .zero_counts = 50}, {.a_m = 0.3, .gear = -80}}, top)));
  Sensors sensors;
  arm.SetBrakes(true);
  for (int k = 0; k < 40; ++k) arm.Step(std::vector<double>{0.4, 0.6}, sensors);
  const double per_rad = 65536 / (2 * std::numbers::pi);
  EXPECT_EQ(sensors.counts[0], std::lround(0.2 * 100 * per_rad) + 50);
  EXPECT_EQ(sensors.counts[1], std::lround((0.3 - 0.5 * 0.2) * -80 * per_rad));
  const double motor1 = 100 * 0.5 * 0.4, motor2 = -80 * 0.5 * 0.6;  // tau = C^T tau_motor
  EXPECT_NEAR(arm.torque_Nm()[0], motor1 - 0.5 * motor2, 1e-9);
  EXPECT_NEAR(arm.torque_Nm()[1], motor2, 1e-9);
}

TEST(CurrentLoop, AfterAStep_FollowsWithItsTimeConstant) {
  Arm arm(MakeScenario("current_time_constant_s = 0.002\n"), WriteText("one.toml", RobotText({JointText{}})));
  Sensors sensors;
  arm.SetBrakes(true);
  for (int k = 1; k <= 10; ++k) {
    arm.Step(std::vector<double>{4.0}, sensors);
    const double current = 4.0 * (1 - std::exp(-k / 2.0));
    EXPECT_NEAR(arm.measured_torque_truth_Nm()[0], 100 * 0.5 * current, 1e-9);
    EXPECT_EQ(sensors.current_lsb[0], std::lround(current / 0.001));  // no noise in this robot
    EXPECT_FALSE(sensors.saturated[0]);
  }
}

TEST(CurrentLoop, UnderARamp_LagsByItsTimeConstant) {
  Arm arm(MakeScenario("command = \"ramp\"\ncurrent_time_constant_s = 0.002\n"),
          WriteText("one.toml", RobotText({JointText{}})));
  Sensors sensors;
  arm.SetBrakes(true);
  for (int k = 1; k <= 20; ++k) {
    arm.Step(std::vector<double>{0.1 * k}, sensors);  // 100 A/s from zero on
    // 2 ms i' = 100 t - i: the ramp less 0.2 A, and what is left of the start.
    const double current = 0.1 * k - 0.2 * (1 - std::exp(-k / 2.0));
    EXPECT_NEAR(arm.measured_torque_truth_Nm()[0], 100 * 0.5 * current, 1e-9) << k;
  }
}

TEST(CurrentLoop, AskedForMoreThanTheLimit_GivesTheLimitAndSaysSo) {
  Arm arm(MakeScenario(), WriteText("one.toml", RobotText({{.gear = -100}})));
  Sensors sensors;
  arm.SetBrakes(true);
  for (int k = 0; k < 40; ++k) arm.Step(std::vector<double>{1000.0}, sensors);
  EXPECT_TRUE(sensors.saturated[0]);
  EXPECT_NEAR(arm.torque_Nm()[0], -500, 1e-9);  // torque_limit of the file
  arm.Step(std::vector<double>{1.0}, sensors);
  EXPECT_FALSE(sensors.saturated[0]);
}

TEST(CurrentSensor, HasTheFilesNoiseInJointTorque) {
  Arm arm(MakeScenario("[sensors]\ntorque_noise_scale = 0.5\n"), WriteText("one.toml", RobotText({{.noise = 8}})));
  Sensors sensors;
  constexpr int kReadings = 20000;
  double sum = 0, square = 0, last = 0, neighbours = 0;
  for (int k = 0; k < kReadings; ++k) {
    arm.Read(sensors);
    const double torque = sensors.current_lsb[0] * 0.001 * 0.5 * 100;
    sum += torque, square += torque * torque, neighbours += torque * last;
    last = torque;
  }
  EXPECT_NEAR(std::sqrt(square / kReadings), 4.0, 0.08);  // 4 standard deviations of the estimate
  EXPECT_NEAR(sum / kReadings, 0.0, 0.12);
  EXPECT_NEAR(neighbours / square, 0.0, 0.03);  // white
}

TEST(CurrentSensor, WithAnotherSeed_HasOtherNoise) {
  const std::string robot = WriteText("one.toml", RobotText({{.noise = 8}}));
  const auto noise = [&](std::uint64_t seed) {
    Scenario scenario = MakeScenario();
    scenario.noise_seed = seed;
    Arm arm(scenario, robot);
    std::vector<int> read;
    Sensors sensors;
    for (int k = 0; k < 50; ++k) arm.Read(sensors), read.push_back(sensors.current_lsb[0]);
    return read;
  };
  // 8 N m are 160 steps, so two streams agree at a reading once in 600 times.
  EXPECT_EQ(noise(6), noise(6));
  for (const std::uint64_t other : {1, 2, 7}) EXPECT_NE(noise(6), noise(other)) << other;
}

TEST(CurrentSensor, BeyondSixteenBits_StandsAtItsEnd) {
  EXPECT_EQ(CurrentLsb(100, 0.001), 32767);
  EXPECT_EQ(CurrentLsb(-100, 0.001), -32767);
  EXPECT_EQ(CurrentLsb(-0.0016, 0.001), -2);
}

TEST(Temperature, OfARestingJoint_ReturnsToAmbientWithItsTimeConstant) {
  Arm arm(MakeScenario("[thermal]\nambient_degC = 20\nstart_degC = 50\ntime_constant_s = 2.0\n"),
          WriteText("one.toml", RobotText({{.coulomb = 100}})));
  Sensors sensors;
  for (int k = 0; k < 2000; ++k) arm.Step(std::vector<double>{0.0}, sensors);
  EXPECT_NEAR(arm.temperature_degC()[0], 20 + 30 * std::exp(-1.0), 0.01);
  EXPECT_NEAR(sensors.temperature_degC[0], arm.temperature_degC()[0], 0.3);  // 6 x the sensor's noise
}

TEST(Temperature, OfAMovingJoint_RisesWithFrictionPower) {
  Arm arm(MakeScenario("[thermal]\nambient_degC = 20\nrise_KpW = 0.5\ntime_constant_s = 0.2\n"),
          WriteText("one.toml", RobotText({{.coulomb = 10,
                                            .viscous = 5,
                                            .link = "mass_kg = 1.0, center_m = [0, 0, 0], "
                                                    "inertia_kgm2 = [0.1, 0, 0, 0.1, 0, 0.1]"}})));
  Sensors sensors;
  for (int k = 0; k < 3000; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, 20)}, sensors);
  EXPECT_NEAR(arm.qd()[0], 2.0, 1e-6);                          // (20 - 10) / 5
  EXPECT_NEAR(arm.temperature_degC()[0], 20 + 0.5 * 40, 0.01);  // 20 N m x 2 rad/s
}

}  // namespace
}  // namespace armcal::plant
