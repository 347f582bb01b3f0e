// plant - tests that each undeclared effect does what its physics says, by formulas written here.
#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

TEST(Stribeck, FadesWithSpeedAndRaisesTheBreakawayLevel) {
  const auto effect = Make("stribeck", "excess_Nm = 12.0\nspeed_radps = 0.1");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0}), 12);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = -0.1}), 6);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0.3}), 1.2);

  Arm arm(MakeScenario("[[effect]]\nkind = \"stribeck\"\njoint = 1\nexcess_Nm = 12.0\nspeed_radps = 0.1\n"),
          WriteText("one.toml", RobotText({{.coulomb = 30}})));
  Sensors sensors;
  double push = 0;
  while (arm.at_rest(0) && push < 100) arm.Step(std::vector<double>{CurrentFor(arm, 0, push += 0.002)}, sensors);
  EXPECT_NEAR(arm.torque_Nm()[0], 42, 0.005);
}

TEST(Stribeck, WithAnExponent_IsTheEmpiricalLaw) {
  const auto effect = Make("stribeck", "excess_Nm = 12.0\nspeed_radps = 0.1\nexponent = 2.0");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0}), 12);
  EXPECT_NEAR(effect->DryLevel({.qd_radps = -0.2}), 12 * 0.01831563888873418, 1e-12);  // exp(-4)
}

TEST(TwoExponentials, FallFromTheFirstLevelToTheSecond) {
  const auto effect =
      Make("friction_exponential", "excess_Nm = 4.0\nfalls_radps = 0.1\nlate_Nm = -3.0\ncomes_radps = 0.5");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0}), 4);
  EXPECT_NEAR(effect->DryLevel({.qd_radps = -0.1}), 4 * 0.36787944117144233 - 3 * 0.006737946999085467, 1e-12);
  EXPECT_NEAR(effect->DryLevel({.qd_radps = 50}), -3 * 0.9900498337491681, 1e-12);
}

TEST(SmoothDry, ReplacesTheCoulombLevelAndIsZeroAtRest) {
  const auto effect = Make("friction_sech_tanh", "excess_Nm = 4.0\nrises_radps = 0.01\nfalls_radps = 0.1");
  EXPECT_DOUBLE_EQ(10 + effect->DryLevel({.qd_radps = 0, .coulomb_Nm = 10}), 0);
  // tanh(1) = 0.7616, 1 / cosh(0.1) = 0.99502
  EXPECT_NEAR(10 + effect->DryLevel({.qd_radps = -0.01, .coulomb_Nm = 10}),
              0.761594155955765 * (10 + 4 * 0.9950207489532266), 1e-12);
  EXPECT_NEAR(10 + effect->DryLevel({.qd_radps = 3, .coulomb_Nm = 10}), 10, 1e-9);
}

TEST(CubeRoot, GrowsWithTheRootAndOpposesMotion) {
  const auto effect = Make("viscous_cuberoot", "drag_at_1radps_Nm = 5.0");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 8}), 10);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = -0.027}), 1.5);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0}), 0);
}

TEST(LoadFriction, GrowsWithTheTransmittedTorqueBeyondThePreload) {
  const auto effect = Make("load_friction", "mu = 0.05\npreload_Nm = 30.0");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.load_Nm = 0}), 0);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.load_Nm = 40}), 0.05 * 20);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.load_Nm = -40}), 0.05 * 20);
}

TEST(LoadFriction, InTheArm_UsesTheLinksTorqueWithoutRotorAndFriction) {
  // A slide that lifts 3 kg straight up at constant force: load = m (g + qdd); rotor 0.2 kg.
  Arm arm(MakeScenario("[[effect]]\nkind = \"load_friction\"\njoint = 1\nmu = 0.1\n"),
          WriteText("lift.toml", RobotText({{.type = "prismatic", .coulomb = 5}})));
  Sensors sensors;
  for (int k = 0; k < 200; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, 60)}, sensors);
  const double load = 3 * (9.81 + arm.qdd()[0]);
  EXPECT_NEAR(arm.undeclared_torque_Nm()[0], 0.1 * load, 1e-6);
  EXPECT_NEAR(arm.torque_Nm()[0], 0.2 * arm.qdd()[0] + load + 5 + 0.1 * load, 1e-6);
}

TEST(Asymmetry, GivesEachDirectionItsOwnLevel) {
  const auto effect = Make("coulomb_asymmetry", "forward_ratio = 1.2\nbackward_ratio = 0.9");
  EXPECT_NEAR(effect->DryLevel({.direction = 1, .coulomb_Nm = 10}), 2, 1e-12);
  EXPECT_NEAR(effect->DryLevel({.direction = -1, .coulomb_Nm = 10}), -1, 1e-12);

  const std::string robot = WriteText("one.toml", RobotText({{.coulomb = 10,
                                                              .link = "mass_kg = 1.0, center_m = [0, 0, 0], "
                                                                      "inertia_kgm2 = [0.1, 0, 0, 0.1, 0, 0.1]"}}));
  const Scenario scenario =
      MakeScenario("[[effect]]\nkind = \"coulomb_asymmetry\"\njoint = 1\nforward_ratio = 1.2\nbackward_ratio = 0.9\n");
  Sensors sensors;
  for (const double push : {11.9, -8.9}) {  // just below the two levels, 12 and 9
    Arm arm(scenario, robot);
    for (int k = 0; k < 50; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, push)}, sensors);
    EXPECT_TRUE(arm.at_rest(0));
    for (int k = 0; k < 50; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, push * 1.05)}, sensors);
    EXPECT_FALSE(arm.at_rest(0));
  }
}

TEST(TorqueOffset, IsAGasCounterweightsResidual) {
  const auto constant = Make("torque_offset", "torque_Nm = -3.0");
  EXPECT_DOUBLE_EQ(constant->Torque({.q_rad = 2}), -3);
  const auto gas = Make("torque_offset", "torque_Nm = 3.0\ncompression_per_rad = 0.1");
  EXPECT_NEAR(gas->Torque({.q_rad = 1}), 3 * std::pow(0.9, -1.3), 1e-12);
  EXPECT_LT(gas->Torque({.q_rad = -1}), 3);
}

TEST(TorqueOffset, InTheArm_PushesAFreeJointBack) {
  // A turn about the vertical: what the motor must give more accelerates the joint the other way when it gives nothing.
  Arm arm(MakeScenario("[[effect]]\nkind = \"torque_offset\"\njoint = 1\ntorque_Nm = 7.0\n"),
          WriteText("one.toml", RobotText({JointText{}})));
  const double inertia = 0.04 + 3 * (0.2 * 0.2 + 0.05 * 0.05) + 100 * 100 * 2e-5;  // body about the axis, and rotor
  EXPECT_NEAR(arm.qdd()[0], -7 / inertia, 1e-9);
  Sensors sensors;
  for (int k = 0; k < 100; ++k) arm.Step(std::vector<double>{0.0}, sensors);
  EXPECT_NEAR(arm.qd()[0], -0.1 * 7 / inertia, 1e-9);
}

TEST(Lubricant, ThinsByVogelsLaw) {
  const auto effect = Make("temp_viscous", "vogel_b_K = 600.0\nvogel_degC = -95.0\nreference_degC = 25.0");
  EXPECT_NEAR(effect->Drag({.temperature_degC = 25, .viscous_Nm = 8}), 0, 1e-12);
  EXPECT_NEAR(effect->Drag({.temperature_degC = 55, .viscous_Nm = 8}), 8 * (std::exp(4.0 - 5.0) - 1), 1e-12);
}

TEST(Ripple, RepeatsInMotorAngleWithASecondHarmonic) {
  const auto effect = Make("torque_ripple", "per_motor_turn = 6\nfirst_Nm = 2.0\nsecond_Nm = 0.5\nphase_rad = 0.3");
  for (const double angle : {0.0, 0.4, 1.7})
    EXPECT_NEAR(effect->Torque({.motor_angle_rad = angle}),
                2 * std::cos(6 * angle + 0.3) + 0.5 * std::sin(2 * (6 * angle + 0.3)), 1e-12);
}

TEST(Ripple, InTheArm_RepeatsWithTheMotorAndNotWithTheJoint) {
  for (const double gear : {100.0, -80.0}) {
    Arm arm(MakeScenario("start_rad = [0.123]\n[[effect]]\nkind = \"torque_ripple\"\njoint = 1\nper_motor_turn = 2\n"
                         "first_Nm = 3.0\nphase_rad = 0.4\n"),
            WriteText("one.toml", RobotText({{.coulomb = 20, .gear = gear}})));
    EXPECT_NEAR(arm.undeclared_torque_Nm()[0], 3 * std::cos(2 * gear * 0.123 + 0.4), 1e-9) << gear;
  }
}

TEST(CablePack, StiffensAwayFromItsNeutralAngle) {
  const auto effect = Make("cable_pack", "stiffness_Nmprad = 2.0\nneutral_rad = 0.5\nstiffening_rad = 1.0");
  EXPECT_DOUBLE_EQ(effect->Torque({.q_rad = 0.5}), 0);
  EXPECT_NEAR(effect->Torque({.q_rad = 0.51}), 0.02, 1e-5);
  EXPECT_NEAR(effect->Torque({.q_rad = 2.5}), 2 * std::sinh(2.0), 1e-12);
  EXPECT_NEAR(effect->Torque({.q_rad = -1.5}), -2 * std::sinh(2.0), 1e-12);
}

TEST(Churning, GrowsWithItsPowerOfSpeedAndOpposesMotion) {
  const auto effect = Make("viscous_cubic", "drag_at_1radps_Nm = 0.5\nexponent = 2.7");
  EXPECT_NEAR(effect->Drag({.qd_radps = 2}), 0.5 * std::pow(2, 2.7), 1e-12);
  EXPECT_NEAR(effect->Drag({.qd_radps = -2}), -0.5 * std::pow(2, 2.7), 1e-12);
}

TEST(SpringBalancer, IsTheGradientOfItsSpringEnergy) {
  const auto effect =
      Make("gravity_spring", "rate_Npm = 3000\ncrank_m = 0.2\nanchor_m = 0.5\nfree_length_m = 0.25\ntop_rad = 0.1");
  const auto energy = [](double q) {
    const double length = std::hypot(0.5 - 0.2 * std::cos(q - 0.1), 0.2 * std::sin(q - 0.1));
    return 0.5 * 3000 * (length - 0.25) * (length - 0.25);
  };
  for (const double q : {-0.7, 0.3, 1.2})
    EXPECT_NEAR(effect->Torque({.q_rad = q}), (energy(q + 1e-5) - energy(q - 1e-5)) / 2e-5, 1e-5);
}

TEST(SecondSeal, AddsCoulombAndViscousFriction) {
  const auto effect = Make("coulomb_viscous", "level_Nm = 3.0\nviscous_Nmsprad = 2.0");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = -1}), 3);
  EXPECT_DOUBLE_EQ(effect->Drag({.qd_radps = -1.5}), -3);
}

TEST(FilmCollapse, PeaksAtItsSpeedAndIsZeroAtRest) {
  const auto effect = Make("stribeck_basis", "excess_Nm = 5.0\nspeed_radps = 0.2");
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = 0}), 0);
  EXPECT_DOUBLE_EQ(effect->DryLevel({.qd_radps = -0.2}), 5);
  EXPECT_NEAR(effect->DryLevel({.qd_radps = 0.4}), 5 * 16.0 / 25.0, 1e-12);  // x = 2: 4 * 4 / 25
  EXPECT_NEAR(effect->DryLevel({.qd_radps = 0.1}), 5 * 16.0 / 25.0, 1e-12);  // and x = 1/2 the same
}

TEST(MeasuredFriction, TakesThePlaceOfTheCoulombLevel) {
  const auto effect = Make("friction_table", "speeds_radps = [0.0, 1.0, 2.0]\nlevels_Nm = [8.0, 4.0, 6.0]");
  const auto level = [&](double v) { return 10 + effect->DryLevel({.qd_radps = v, .coulomb_Nm = 10}); };
  EXPECT_DOUBLE_EQ(level(0), 8);
  EXPECT_DOUBLE_EQ(level(-0.25), 7);
  EXPECT_DOUBLE_EQ(level(1.5), 5);
  EXPECT_DOUBLE_EQ(level(9), 6);
  EXPECT_THROW(Make("friction_table", "speeds_radps = [0.0, 0.0]\nlevels_Nm = [8.0, 4.0]"), io::InputError);
  EXPECT_THROW(Make("friction_table", "speeds_radps = [0.0, 1.0]\nlevels_Nm = [8.0]"), io::InputError);
}

TEST(Turbulence, GrowsWithTheSquareAndOpposesMotion) {
  const auto effect = Make("viscous_quadratic", "drag_at_1radps_Nm = 0.5");
  EXPECT_DOUBLE_EQ(effect->Drag({.qd_radps = 3}), 4.5);
  EXPECT_DOUBLE_EQ(effect->Drag({.qd_radps = -3}), -4.5);
}

TEST(PumpingSeal, GivesEachDirectionItsOwnViscosity) {
  const auto effect = Make("viscous_asymmetry", "forward_ratio = 1.5\nbackward_ratio = 0.75");
  EXPECT_DOUBLE_EQ(effect->Drag({.qd_radps = 1, .viscous_Nm = 8}), 4);
  EXPECT_DOUBLE_EQ(effect->Drag({.qd_radps = -1, .viscous_Nm = -8}), 2);
}

TEST(SofteningSeal, FallsToAnEthWithinItsTemperature) {
  const auto effect = Make("temp_coulomb", "softening_K = 40.0\nreference_degC = 25.0");
  EXPECT_NEAR(effect->DryLevel({.temperature_degC = 25, .coulomb_Nm = 10}), 0, 1e-12);
  EXPECT_NEAR(10 + effect->DryLevel({.temperature_degC = 65, .coulomb_Nm = 10}), 10 * 0.36787944117144233, 1e-12);
}

TEST(ChangeInTime, TendsToItsEnd) {
  const auto seal = Make("time_varying_coulomb", "change = 0.5\ntime_constant_s = 10.0");
  EXPECT_DOUBLE_EQ(seal->DryLevel({.coulomb_Nm = 20, .since_s = 0}), 0);
  EXPECT_NEAR(seal->DryLevel({.coulomb_Nm = 20, .since_s = 10}), 10 * 0.6321205588285577, 1e-12);
  const auto oil = Make("time_varying_viscous", "change = -0.5\nhalf_time_s = 10.0");
  EXPECT_DOUBLE_EQ(oil->Drag({.viscous_Nm = 20, .since_s = 10}), -5);
  EXPECT_DOUBLE_EQ(oil->Drag({.viscous_Nm = 20, .since_s = 30}), -7.5);
}

TEST(EccentricMesh, ChangesTheLevelWithTheMotorsAngle) {
  const auto effect = Make("meshing_friction", "per_motor_turn = 0.25\ndepth = 0.5\nphase_rad = 1.0");
  const double turn = 2 * std::numbers::pi;
  EXPECT_NEAR(effect->DryLevel({.motor_angle_rad = -4, .coulomb_Nm = 10}), 5, 1e-12);
  EXPECT_NEAR(effect->DryLevel({.motor_angle_rad = 2 * turn - 4, .coulomb_Nm = 10}), -5, 1e-12);
}

TEST(PlacesOfARange, HaveTheirOwnFriction) {
  const auto dent = Make("position_friction", "level_Nm = 6.0\nat_rad = 0.5\nwidth_rad = 0.2");
  EXPECT_DOUBLE_EQ(dent->DryLevel({.q_rad = 0.5}), 6);
  EXPECT_NEAR(dent->DryLevel({.q_rad = 0.3}), 3, 1e-12);
  const auto film = Make("position_viscous", "eccentricity = 0.5\nat_rad = 0.5");
  EXPECT_NEAR(film->Drag({.q_rad = 0.5, .viscous_Nm = 4}), 4, 1e-12);  // half as thick: twice the torque
  EXPECT_NEAR(film->Drag({.q_rad = 0.5 + std::numbers::pi, .viscous_Nm = 4}), 4 / 1.5 - 4, 1e-12);
}

TEST(LoadShare, CarriesAShareOfTheLoad) {
  EXPECT_DOUBLE_EQ(Make("load_linear", "share = -0.25")->Torque({.load_Nm = 8}), -2);
  EXPECT_THROW(Make("load_linear", "share = 0.6"), io::InputError);
}

TEST(TightHose, PullsBeyondItsAngleOnly) {
  const auto effect = Make("position_torque", "torque_at_1rad_Nm = 3.0\nfrom_rad = 0.2\nside = -1");
  EXPECT_DOUBLE_EQ(effect->Torque({.q_rad = 0.3}), 0);
  EXPECT_NEAR(effect->Torque({.q_rad = 0.2 - 4}), -3 * 8, 1e-12);
}

TEST(AnyEffect, WithAFromTime_IsNotThereBefore) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"torque_offset\"\njoint = 1\ntorque_Nm = 7.0\nfrom_s = 0.01\n"),
          WriteText("one.toml", RobotText({JointText{}})));
  arm.SetBrakes(true);
  Sensors sensors;
  for (int k = 1; k <= 20; ++k) {
    arm.Step(std::vector<double>{0.0}, sensors);
    EXPECT_EQ(arm.undeclared_torque_Nm()[0], k >= 10 ? 7.0 : 0.0) << k;
  }
}

TEST(PayloadStep, AddsItsWeightAtTheFlangeFromItsTimeOnAndTakesItAway) {
  const std::string top = "dh = \"modified\"\ntool_frame = { xyz_m = [0.5, 0, 0] }\n";
  Arm arm(MakeScenario("[[effect]]\nkind = \"payload_step\"\nmass_kg = 2.0\ncenter_m = [0.1, 0, 0]\n"
                       "inertia_kgm2 = [0.01, 0, 0, 0.01, 0, 0.01]\nfrom_s = 0.01\nuntil_s = 0.02\n"),
          WriteText("one.toml", RobotText({{.alpha_deg = -90}}, top)));
  arm.SetBrakes(true);
  Sensors sensors;
  const double weight = -2.0 * 9.81 * 0.6;  // axis 1 turns about +y: a mass at +x is carried by a negative torque
  for (int k = 1; k <= 30; ++k) {
    arm.Step(std::vector<double>{0.0}, sensors);
    EXPECT_NEAR(arm.undeclared_torque_Nm()[0], k >= 10 && k < 20 ? weight : 0, 1e-9) << k;
  }
}

TEST(BaseTilt, TurnsGravityAgainstTheDeclaredBase) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"base_tilt\"\nroll_deg = 1.0\n"),
          WriteText("one.toml", RobotText({JointText{}})));
  // Base turned by +1 deg about x: gravity in the base frame is g (0, -sin, -cos); torque about z of m at (0.2, 0.05).
  const double g_y = -9.81 * std::sin(std::numbers::pi / 180);
  EXPECT_NEAR(arm.undeclared_torque_Nm()[0], -0.2 * 3 * g_y, 1e-6);
}

}  // namespace
}  // namespace armcal::plant
