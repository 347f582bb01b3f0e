// plant - tests the shipped scenarios on the shipped arm, with the gains of the robot file.
#include <filesystem>
#include <set>

#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

const std::string kFolder = "host_sim/scenarios/";

Eigen::VectorXd SampleNoise(const Arm& arm) {
  Eigen::VectorXd noise(arm.joints());
  for (int j = 0; j < arm.joints(); ++j)
    noise[j] = arm.robot().joint[static_cast<std::size_t>(j)].torque_noise_Nm / std::sqrt(8.0);
  return noise;
}

TEST(ShippedArm, UnderItsOwnGains_TracksTheExcitationWithinMilliradians) {
  Arm arm(ReadScenario(kFolder + "none.toml"), kEr20);
  Er20Run run(arm);
  Eigen::VectorXd worst = Eigen::VectorXd::Zero(6);
  for (int k = 0; k < 12000; ++k) {
    run.Tick();
    if (k > 2000) worst = worst.cwiseMax((run.wanted() - arm.q()).cwiseAbs());
  }
  // Without feed-forward the error is torque / kp: 800 N m / 80000, 25 N m / 1500 ...
  for (int j = 0; j < 6; ++j) EXPECT_LT(worst[j], 0.025) << "joint " << j + 1;
}

TEST(ShippedArm, HeldAtOnePose_ComesToRestCompletely) {
  Arm arm(ReadScenario(kFolder + "stribeck.toml"), kEr20);
  Eigen::VectorXd q, qd;
  Wave::At(3, q, qd);
  arm.Place({q.data(), 6});
  PdLoop loop(arm, {60000, 80000, 40000, 4000, 3000, 1500}, {1500, 2000, 1000, 60, 45, 20});
  for (int k = 0; k < 1500; ++k) loop.Tick(q, Eigen::VectorXd::Zero(6));
  const Eigen::VectorXd rest = arm.q();
  for (int k = 0; k < 1000; ++k) loop.Tick(q, Eigen::VectorXd::Zero(6));
  EXPECT_EQ((arm.q() - rest).norm(), 0.0);
}

TEST(ShippedScenarios, WithEqualSeeds_GiveEqualReadings) {
  Arm a(ReadScenario(kFolder + "load_friction.toml"), kEr20), b(ReadScenario(kFolder + "load_friction.toml"), kEr20);
  Er20Run run_a(a), run_b(b);
  for (int k = 0; k < 300; ++k) run_a.Tick(), run_b.Tick();
  EXPECT_EQ(run_a.loop().sensors().counts, run_b.loop().sensors().counts);
  EXPECT_EQ(run_a.loop().sensors().current_lsb, run_b.loop().sensors().current_lsb);
}

// An effect to be found must stand out of one estimator sample's noise, but not dwarf it; the others must be absent.
TEST(ShippedScenarios, HaveEffectsAboutAsLargeAsTheNoise) {
  int files = 0;
  std::set<std::string> kinds;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (entry.path().extension() != ".toml") continue;
    ++files;
    const Scenario scenario = ReadScenario(entry.path().string());
    Arm arm(scenario, kEr20);
    Er20Run run(arm);
    Eigen::VectorXd square = Eigen::VectorXd::Zero(6);
    const bool slow = scenario.payload || entry.path().stem() == "temperature";
    const int ticks = slow ? 20000 : 6000, from = slow ? 15000 : 2000;
    for (int k = 0; k < ticks; ++k) {
      run.Tick();
      if (k >= from) square += arm.undeclared_torque_Nm().cwiseAbs2();
    }
    const Eigen::VectorXd size = (square / (ticks - from)).cwiseSqrt().cwiseQuotient(SampleNoise(arm));
    bool everywhere = false;
    std::set<int> joints;
    for (const Undeclared& effect : scenario.undeclared()) {
      kinds.insert(effect.kind);
      everywhere = everywhere || effect.joint == "flange" || effect.joint == "base";
      if (everywhere) continue;
      joints.insert(std::stoi(effect.joint) - 1);
      if (effect.kind == "wrist_coupling")  // "5-6", and it acts on both
        joints.insert(std::stoi(effect.joint.substr(effect.joint.find('-') + 1)) - 1);
    }
    EXPECT_TRUE(!everywhere || (size.maxCoeff() > 0.6 && size.maxCoeff() < 2))
        << entry.path() << " " << size.transpose();
    for (int j = 0; j < 6 && !everywhere; ++j) {
      const bool fits = joints.contains(j) ? size[j] > 0.6 && size[j] < 2 : size[j] == 0;
      EXPECT_TRUE(fits) << entry.path() << " joint " << j + 1 << ": " << size[j];
    }
  }
  EXPECT_GE(files, 10);
  EXPECT_GE(kinds.size(), 9u);
}

}  // namespace
}  // namespace armcal::plant
