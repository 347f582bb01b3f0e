// choice tests - choose the friction law of an arm whose friction is known.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/choice/block_errors.hpp"
#include "host_sim/identify/choice/choose.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::choice {
namespace {

using tests::State;

codegen::Robot TwoLink() { return codegen::ReadRobot("codegen/robots/two_link.toml"); }

struct Outcome {
  Choice choice;
  std::vector<HeldOut> held_out;  // [joint]
  std::string Law(std::size_t j) const { return choice.laws[choice.joint[j].chosen].name; }
  const LawError& Of(std::size_t j, const std::string& name) const {
    std::size_t l = 0;
    while (choice.laws[l].name != name) ++l;
    return choice.joint[j].law[l];
  }
};

// Friction beside Coulomb and viscous friction, of a two-link arm that carries its links against gravity.
Outcome ChooseFor(const tests::Effect& effect, std::uint64_t seed = 11) {
  const codegen::Robot robot = TwoLink();
  tests::SyntheticArm arm(robot, 3);
  const std::vector<calibration::Dataset> train{arm.Run(30, seed, effect)}, test{arm.Run(20, seed + 100, effect)};
  Outcome out{Choose(robot, tests::Records(), train), {}};
  out.held_out = Judge(out.choice, robot, tests::Records(), train, test)[0];
  return out;
}

TEST(Choose, AnArmWithoutMoreFriction_KeepsCoulombAndViscous) {
  int kept = 0;
  for (std::uint64_t seed = 21; seed < 24; ++seed) {
    const Outcome out = ChooseFor({}, seed);
    for (std::size_t j = 0; j < 2; ++j) kept += out.Law(j) == "coulomb_viscous";
  }
  EXPECT_GE(kept, 5);  // of 6: one law in twenty is beaten by chance
}

TEST(Choose, Stribeck_IsNotTakenForCoulombAndViscous_OnItsJointAlone) {
  const Outcome out = ChooseFor(
      [](const State& s) { return s.joint != 1 ? 0 : (s.qd > 0 ? 2.0 : -2.0) * std::exp(-std::abs(s.qd) / 0.15); });
  EXPECT_EQ(out.Law(0), "coulomb_viscous");
  EXPECT_TRUE(out.Of(1, "coulomb_viscous").beaten);
  EXPECT_FALSE(out.Of(1, "stribeck").beaten);
  EXPECT_TRUE(out.choice.joint[1].differ);
  EXPECT_LT(out.held_out[1].over_plain.high, 0);
  EXPECT_LT(out.held_out[1].chosen_Nm, out.held_out[1].plain_Nm);
}

TEST(Choose, FrictionThatGrowsWithTheLoad_IsNamed) {
  const Outcome out =
      ChooseFor([](const State& s) { return s.joint != 0 ? 0 : 0.1 * std::abs(s.tau_rigid) * (s.qd > 0 ? 1 : -1); });
  EXPECT_EQ(out.Law(0), "load_friction");
  EXPECT_LT(out.held_out[0].over_plain.high, -0.2);
}

TEST(Choose, TheErrorOfTheTrueLaw_IsTheNoise) {
  tests::SyntheticArm arm(TwoLink(), 3);
  const Outcome out = ChooseFor({});
  for (int j = 0; j < 2; ++j) {
    const auto at = static_cast<std::size_t>(j);
    EXPECT_NEAR(out.Of(at, "coulomb_viscous").rms_Nm, arm.noise_Nm(j), 0.05 * arm.noise_Nm(j));
    EXPECT_NEAR(out.held_out[at].plain_Nm, arm.noise_Nm(j), 0.06 * arm.noise_Nm(j));
  }
}

TEST(Choose, AJointThatRests_IsNotJudged_AndTheOthersAre) {
  const codegen::Robot robot = TwoLink();
  tests::SyntheticArm arm(robot, 3);
  const auto friction = [](const State& s) {
    return s.joint != 0 ? 0 : 0.1 * std::abs(s.tau_rigid) * (s.qd > 0 ? 1 : -1);
  };
  const auto run = [&](double seconds, std::uint64_t seed, const std::vector<int>& still) {
    return std::vector<calibration::Dataset>{arm.Run(seconds, seed, friction, 0.5, still)};
  };
  const std::vector<calibration::Dataset> train = run(30, 11, {1});
  const Choice choice = Choose(robot, tests::Records(), train);
  EXPECT_NE(choice.joint[1].failed, "");
  EXPECT_EQ(choice.joint[0].failed, "");
  EXPECT_EQ(choice.laws[choice.joint[0].chosen].name, "load_friction");
  const HeldOut rests = Judge(choice, robot, tests::Records(), train, run(20, 12, {1}))[0][1];
  EXPECT_TRUE(std::isnan(rests.over_plain.value) && std::isnan(rests.plain_Nm));
  EXPECT_THROW((void)Choose(robot, tests::Records(), run(30, 13, {0, 1})), io::InputError);
}

TEST(Choose, ALogThatIsTooShort_AndARobotWithALawOfItsOwn_AreRefused) {
  const codegen::Robot robot = TwoLink();
  tests::SyntheticArm arm(robot, 3);
  EXPECT_THROW((void)Choose(robot, tests::Records(), {arm.Run(4, 1)}), io::InputError);
  codegen::Robot own = robot;
  codegen::EffectUse use;
  use.effect = "stribeck", use.joints = {0};
  own.effect.push_back(use);
  EXPECT_THROW((void)Choose(own, tests::Records(), {arm.Run(20, 1)}), io::InputError);
}

// 30 stretches of 2 s. Twice the error everywhere is +100 %, whatever is drawn; one stretch that holds all the
// difference leaves the interval open to zero.
TEST(BlockErrors, AnInterval_KnowsWhetherTheDifferenceIsEverywhere) {
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(30, 1, 2), a = 4 * b;
  const Ratio same = Compare(a, b);
  EXPECT_NEAR(same.value, 1, 1e-12);
  EXPECT_NEAR(same.low, 1, 1e-12);
  EXPECT_NEAR(same.high, 1, 1e-12);
  Eigen::VectorXd one = b;
  one[7] += 20;
  const Ratio once = Compare(one, b);
  EXPECT_GT(once.value, 0.1);
  EXPECT_EQ(once.low, 0);
  Eigen::VectorXd few = Eigen::VectorXd::Zero(30);
  few.tail(2) = b.tail(2);  // the joint rests in the other stretches
  EXPECT_NEAR(Compare(4 * few, few).low, 1, 1e-12);
  EXPECT_TRUE(std::isnan(Compare(0 * few, 0 * few).value));
}

// What a fold leaves out and what it is judged on are the same stretches.
TEST(BlockErrors, AFold_LeavesOutEachFifthStretch) {
  tests::SyntheticArm arm(TwoLink(), 3);
  calibration::Dataset log = arm.Run(60, 5);
  log.used.setOnes();
  const calibration::Dataset without = Without(log, 2, 5);
  const Eigen::MatrixXd left = Eigen::MatrixXd::Ones(log.samples(), 2) - without.used.cast<double>();
  const Eigen::MatrixXd squares = SquaresByStretch(log, left);
  ASSERT_EQ(squares.rows(), 29);  // 59.992 s
  for (Eigen::Index s = 0; s < squares.rows(); ++s)
    EXPECT_EQ(squares(s, 0), s % 5 == 2 ? Stretches(log).samples : 0) << s;
}

}  // namespace
}  // namespace armcal::choice
