// plant - tests two masses and a gap, forces from outside, other joints' motion, and the torque's reading.
#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

constexpr double kRotor = 100 * 100 * 2e-5;                     // of bench's joint, on the joint's side
constexpr double kLink = 0.04 + 3 * (0.2 * 0.2 + 0.05 * 0.05);  // about a vertical axis

std::string OneJoint(const JointText& joint = {}, const std::string& top = "dh = \"modified\"\n") {
  return WriteText("one.toml", RobotText({joint}, top));
}

void Play(Arm& arm, double torque, int ticks) {
  Sensors sensors;
  for (int k = 0; k < ticks; ++k) arm.Step(std::vector<double>{CurrentFor(arm, 0, torque)}, sensors);
}

TEST(Belt, BehindAHeldMotor_RingsAtItsFrequency) {
  const double stiffness = 200, period = 2 * std::numbers::pi * std::sqrt(kLink / stiffness);
  Arm arm(MakeScenario("[[effect]]\nkind = \"belt_elasticity\"\njoint = 1\nstiffness_Nmprad = 200.0\n"), OneJoint());
  Play(arm, 5, 50);
  arm.SetBrakes(true);
  int crossings = 0;
  double first = 0, last = 0, before = arm.link_ahead()[0];
  for (int k = 0; k < 3000; ++k) {
    Play(arm, 0, 1);
    const double now = arm.link_ahead()[0];
    if (before < 0 && now >= 0) {
      last = arm.time_s() - 0.001 * now / (now - before);
      if (crossings++ == 0) first = last;
    }
    before = now;
  }
  ASSERT_GT(crossings, 5);
  EXPECT_NEAR((last - first) / (crossings - 1), period, 1e-3 * period);
}

TEST(Belt, KeepsTheMomentumOfMotorAndLink) {
  Arm arm(MakeScenario("current_time_constant_s = 1e-6\n[[effect]]\nkind = \"belt_elasticity\"\njoint = 1\n"
                       "stiffness_Nmprad = 300.0\ndamping_Nmsprad = 1.0\n"),
          OneJoint());
  Play(arm, 7, 400);
  // Torque x time is in both masses together; after the ringing is damped away both have one speed.
  Play(arm, 0, 4000);
  EXPECT_NEAR(arm.qd()[0], 7 * 0.4 / (kRotor + kLink), 2e-3 * 7 * 0.4 / (kRotor + kLink));
}

TEST(Compliance, LetsTheLinkHangByItsWeight) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"joint_compliance\"\njoint = 1\nstiffness_Nmprad = 2000.0\n"),
          OneJoint({.alpha_deg = -90, .coulomb = 100}));
  // Axis 1 turns about +y; a mass at x = 0.2, z = -0.05 (bench's centre is at y = 0.05, and -90 deg about x turns it).
  const double hang = arm.link_ahead()[0], q = hang;
  const double x = 0.2 * std::cos(q) - 0.05 * std::sin(q);
  EXPECT_NEAR(2000 * hang, 3 * 9.81 * x, 1e-6 * 2000 * std::abs(hang));
  arm.SetBrakes(true);
  Play(arm, 0, 200);
  EXPECT_NEAR(arm.link_ahead()[0], hang, 1e-9);
}

TEST(Backlash, LetsTheMotorRunFreeInsideTheGap) {
  Arm arm(MakeScenario("current_time_constant_s = 1e-6\n[[effect]]\nkind = \"backlash\"\njoint = 1\n"
                       "stiffness_Nmprad = 400.0\ndamping_Nmsprad = 3.0\ngap_rad = 0.02\n"),
          OneJoint());
  EXPECT_EQ(arm.link_ahead()[0], 0);  // nothing presses about a vertical axis: the link stays in the middle
  Play(arm, 0.5, 1);
  EXPECT_NEAR(arm.qdd()[0], 0.5 / kRotor, 1e-9);  // the rotor alone
  EXPECT_NEAR(arm.undeclared_torque_Nm()[0], -kLink * 0.5 / kRotor, 1e-6);
  Play(arm, 0.5, 3000);
  EXPECT_NEAR(arm.qdd()[0], 0.5 / (kRotor + kLink), 0.02 * 0.5 / (kRotor + kLink));
  EXPECT_LT(arm.link_ahead()[0], -0.01);  // half the gap and the teeth's bending
}

TEST(Transmission, ThatTheStepsCannotFollow_IsRefused) {
  EXPECT_THROW(
      Arm(MakeScenario("[[effect]]\nkind = \"belt_elasticity\"\njoint = 1\nstiffness_Nmprad = 1e7\n"), OneJoint()),
      io::InputError);
}

TEST(Flywheel, AddsItsInertia) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"rotor_inertia\"\njoint = 1\ninertia_kgm2 = 0.3\n"), OneJoint());
  Play(arm, 4, 100);
  EXPECT_NEAR(arm.qdd()[0], 4 / (kRotor + kLink + 0.3), 1e-9);
  EXPECT_NEAR(arm.undeclared_torque_Nm()[0], 0.3 * arm.qdd()[0], 1e-9);
}

const std::string kTool = "dh = \"modified\"\ntool_frame = { xyz_m = [0.5, 0, 0] }\n";

TEST(Hose, IsTheGradientOfItsEnergy) {
  const auto energy = [](double q) {
    const double stretch = std::hypot(0.9 - 0.5 * std::cos(q), 0.1 - 0.5 * std::sin(q), 0.3) - 0.2;
    return 0.5 * 100 * stretch * stretch + 0.25 * 100 * std::pow(stretch, 4) / (0.4 * 0.4);
  };
  for (const double q : {-0.6, 0.2, 1.4}) {
    Arm arm(MakeScenario("start_rad = [" + std::to_string(q) +
                         "]\n[[effect]]\nkind = \"flange_hose\"\nanchor_m = [0.9, 0.1, 0.3]\nrate_Npm = 100.0\n"
                         "free_length_m = 0.2\nstiffening_m = 0.4\nmass_kg = 2.0\n"),
            OneJoint({}, kTool));
    EXPECT_NEAR(arm.undeclared_torque_Nm()[0], (energy(q + 1e-6) - energy(q - 1e-6)) / 2e-6, 1e-5) << q;
  }
}

TEST(Hose, HangsWithHalfItsWeight) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"flange_hose\"\nanchor_m = [0.5, 0.0, 0.0]\nrate_Npm = 100.0\n"
                       "mass_kg = 2.0\n"),
          OneJoint({.alpha_deg = -90}, kTool));
  EXPECT_NEAR(arm.undeclared_torque_Nm()[0], -0.5 * 2 * 9.81 * 0.5, 1e-9);  // axis +y carries a mass at +x backwards
}

TEST(Pad, PushesAlongItsNormalAndSlipsAtTheCone) {
  const toml::table table = toml::parse(
      "at_m = [0.0, 0.0, 1.0]\nnormal = [0.0, 0.0, 2.0]\nrate_Npm = 1000.0\ndamping_Nspm = 50.0\nfriction = 0.3\n");
  const io::TomlReader keys(table, "test");
  const auto pad = AllLinkForces().at("flange_contact")(keys);
  keys.Finish();
  const KDL::Vector rest = KDL::Vector::Zero();
  EXPECT_EQ(pad->At({0, 0, 1.001}, rest, 0).Norm(), 0);
  pad->Remember({0.1, 0.2, 1.0});  // where it touches
  pad->Remember({0.1, 0.2, 0.99});
  const KDL::Vector straight = pad->At({0.1, 0.2, 0.99}, rest, 0);
  EXPECT_NEAR(straight.z(), 10, 1e-9);
  EXPECT_NEAR(pad->At({0.1, 0.2, 0.99}, {0, 0, -0.1}, 0).z(), 15, 1e-9);
  EXPECT_NEAR(pad->At({0.102, 0.2, 0.99}, rest, 0).x(), -2, 1e-9);  // sticks: spring of 1000 N/m
  EXPECT_NEAR(pad->At({0.15, 0.2, 0.99}, rest, 0).x(), -3, 1e-9);   // slips: 0.3 x 10 N
  pad->Remember({0.15, 0.2, 0.99});
  EXPECT_NEAR(pad->At({0.148, 0.2, 0.99}, rest, 0).x(), -1, 1e-9);  // came along, 3 mm behind
}

TEST(Pad, InTheArm_IsAWallForTheJoint) {
  // The flange starts at x = 0.5, y = 0 and is turned towards +y into a wall at y = 0.05.
  Arm arm(MakeScenario("[[effect]]\nkind = \"flange_contact\"\nat_m = [0.5, 0.05, 0.0]\nnormal = [0.0, -1.0, 0.0]\n"
                       "rate_Npm = 20000.0\ndamping_Nspm = 200.0\nfriction = 0.0\n"),
          OneJoint({.viscous = 2}, kTool));
  Play(arm, 10, 6000);
  const double depth = 0.5 * std::sin(arm.q()[0]) - 0.05;
  EXPECT_NEAR(20000 * depth * 0.5 * std::cos(arm.q()[0]), 10, 0.01);
}

TEST(Push, TurnsTheJointsBelowItsPoint) {
  Arm arm(MakeScenario("[[effect]]\nkind = \"external_contact\"\njoint = 1\npoint_m = [0.3, 0.1, 0.0]\n"
                       "force_N = [10.0, 20.0, 99.0]\nfrom_s = 0.1\nfor_s = 0.4\nrise_s = 0.1\n"),
          OneJoint());
  arm.SetBrakes(true);
  for (const auto& [until, share] :
       std::initializer_list<std::pair<int, double>>{{99, 0}, {150, .5}, {300, 1}, {475, .25}, {600, 0}}) {
    Play(arm, 0, until - static_cast<int>(std::lround(arm.time_s() * 1000)));
    EXPECT_NEAR(arm.undeclared_torque_Nm()[0], -share * (0.3 * 20 - 0.1 * 10), 0.051)
        << until;  // a tick is a hundredth of the rise
  }
}

JointState Of(const std::vector<double>& q, const std::vector<double>& qd, int joint) {
  JointState s{.q_rad = q[static_cast<std::size_t>(joint)], .qd_radps = qd[static_cast<std::size_t>(joint)]};
  s.all_q = q, s.all_qd = qd, s.all_motor = q, s.all_load = qd;
  return s;
}

TEST(SharedShaft, TakesItsPowerFromBothJoints) {
  const auto here = Make("wrist_coupling", "of_joint = 1\nratio = 0.5\nlevel_Nm = 3.0\nviscous_Nmsprad = 2.0", 1);
  const auto there = here->AtTheOtherJoint();
  std::vector<double> memory(1);
  const std::vector<double> from{0, 0}, to{0.2, 0.4}, qd{0.6, 1.1};
  here->Begin(Of(from, qd, 1), memory);
  here->Remember(Of(to, qd, 1), memory);
  JointState s1 = Of(to, qd, 1), s0 = Of(to, qd, 0);
  s1.memory = s0.memory = memory;
  const double shaft = 1.1 + 0.5 * 0.6;
  EXPECT_NEAR(here->Torque(s1), 3 + 2 * shaft, 1e-12);
  EXPECT_NEAR(here->Torque(s1) * 1.1 + there->Torque(s0) * 0.6, (3 + 2 * shaft) * shaft, 1e-12);
}

TEST(DraggingShaft, FollowsTheOtherJointAlone) {
  const auto effect = Make("coupled_friction", "of_joint = 2\nlevel_Nm = 3.0\nviscous_Nmsprad = 2.0", 0);
  std::vector<double> memory(1);
  const std::vector<double> from{0, 0}, to{0.5, -0.4}, qd{9, -1};
  effect->Begin(Of(from, qd, 0), memory);
  effect->Remember(Of(to, qd, 0), memory);
  JointState s = Of(to, qd, 0);
  s.memory = memory;
  EXPECT_NEAR(effect->Torque(s), -3 - 2, 1e-12);
  EXPECT_EQ(effect->AtTheOtherJoint(), nullptr);
  EXPECT_THROW(Make("coupled_friction", "of_joint = 1", 0), io::InputError);
}

TEST(OtherJoints, RippleAndSpin) {
  const std::vector<double> q{0.3, 0.7}, qd{2, 3};
  const auto teeth = Make("cross_ripple", "of_joint = 2\nper_motor_turn = 4\nfirst_Nm = 2.0\nphase_rad = 0.1", 0);
  EXPECT_NEAR(teeth->Torque(Of(q, qd, 0)), 2 * std::cos(4 * 0.7 + 0.1), 1e-12);
  const auto wheel = Make("velocity_product", "of_joint = 2\ninertia_kgm2 = 0.5", 0);
  EXPECT_NEAR(wheel->Torque(Of(q, qd, 0)), 3, 1e-12);
}

TEST(ByPoints, LooksUpAnySignalAndMultiplies) {
  const auto effect = Make("unknown",
                           "of_joint = 2\nover = \"q\"\nacts = \"torque\"\nat = [0.0, 1.0]\ntorque_Nm = [0.0, 10.0]\n"
                           "times = { over = \"qd\", at = [0.0, 4.0], factor = [1.0, 3.0] }",
                           0);
  EXPECT_NEAR(effect->Torque(Of({0.3, 0.7}, {2, 3}, 0)), 7 * 2, 1e-12);
  const auto dry = Make("unknown", "over = \"load\"\nacts = \"dry\"\nat = [-1.0, 3.0]\ntorque_Nm = [0.0, 8.0]", 1);
  EXPECT_NEAR(dry->DryLevel(Of({0, 0}, {0, 1}, 1)), 4, 1e-12);  // `Of` has the speeds as loads
  EXPECT_THROW(Make("unknown", "over = \"x\"\nacts = \"dry\"\nat = [0, 1]\ntorque_Nm = [0, 1]", 1), io::InputError);
}

// Torque by nominal constants that the drive reads without noise, tick by tick, for a step of the command at tick 10.
std::vector<double> Readings(const std::string& effect, int ticks, double torque = 20) {
  Arm arm(MakeScenario("current_time_constant_s = 1e-6\n[sensors]\ntorque_noise_scale = 0\n" + effect), OneJoint());
  arm.SetBrakes(true);
  Sensors sensors;
  std::vector<double> read;
  for (int k = 0; k < ticks; ++k) {
    arm.Step(std::vector<double>{CurrentFor(arm, 0, k < 10 ? 0 : torque)}, sensors);
    read.push_back(sensors.current_lsb[0] * 0.001 * 100 * 0.5);
  }
  return read;
}

constexpr double kStep = 0.001 * 100 * 0.5;  // of a reading, N m

TEST(Reading, WaitsInTheWire) {
  const auto read = Readings("[[effect]]\nkind = \"time_delay\"\nlate_s = 0.005\n", 30);
  for (int k = 0; k < 30; ++k) EXPECT_NEAR(read[static_cast<std::size_t>(k)], k < 15 ? 0 : 20, kStep) << k;
}

TEST(Reading, IsSmoothedByItsLags) {
  const auto one = Readings("[[effect]]\nkind = \"torque_filter\"\nlag_s = 0.02\n", 50);
  EXPECT_NEAR(one[29], 20 * (1 - std::exp(-1)), kStep);  // 20 ticks after the step
  const auto two = Readings("[[effect]]\nkind = \"torque_filter\"\nlag_s = 0.02\nstages = 2\njoint = 1\n", 50);
  EXPECT_NEAR(two[29], 20 * (1 - 2 * std::exp(-1)), 0.4);  // continuous lags; a tick is a twentieth of one
}

TEST(Reading, HasItsGainDriftRippleAndEnd) {
  EXPECT_NEAR(Readings("[[effect]]\nkind = \"torque_gain_error\"\njoint = 1\nerror = -0.1\n", 20)[19], 18, kStep);
  EXPECT_NEAR(Readings("[[effect]]\nkind = \"torque_saturation\"\njoint = 1\nlimit_Nm = 12.0\n", 20, -20)[19], -12,
              kStep);
  const auto drift = Readings(
      "[[effect]]\nkind = \"torque_drift\"\njoint = 1\ntorque_Nm = 4.0\ntime_constant_s = 0.1\nfrom_s = 0.1\n", 201, 0);
  EXPECT_EQ(drift[98], 0);
  EXPECT_NEAR(drift[199], 4 * (1 - std::exp(-1)), kStep);
  const auto ripple = Readings(
      "[[effect]]\nkind = \"current_ripple\"\njoint = 1\npole_pairs = 3\nzero_Nm = 5.0\nscale_error = 0.2\n", 20);
  EXPECT_NEAR(ripple[19], 20 * 1.2 + 5, kStep);  // at zero
}

TEST(Scenario, NamesWhatIsUndeclared) {
  const Scenario s = MakeScenario(
      "[[effect]]\nkind = \"wrist_coupling\"\njoint = 2\nof_joint = 1\nratio = 0.5\nlevel_Nm = 1.0\n"
      "[[effect]]\nkind = \"time_delay\"\nlate_s = 0.002\n"
      "[[effect]]\nkind = \"flange_hose\"\nanchor_m = [0, 0, 1]\nrate_Npm = 10\n");
  std::string text;
  for (const Undeclared& u : s.undeclared()) text += u.kind + " " + u.joint + "; ";
  EXPECT_EQ(text, "wrist_coupling 1-2; time_delay all; flange_hose flange; ");
  EXPECT_THROW(MakeScenario("[[effect]]\nkind = \"no_such\"\n"), io::InputError);
  EXPECT_THROW(Arm(s, OneJoint()), io::InputError);  // one joint only
}

}  // namespace
}  // namespace armcal::plant
