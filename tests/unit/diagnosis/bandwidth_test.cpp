// diagnosis tests - check the second bandwidth: what the derivation of the motion leaves is no effect.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/dataset.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;

constexpr double kNoise_radps2 = 0.05;

// A run whose motion is read this much late, as a filter with a lag of its own would leave it; and the same run with
// the motion as it was: what another bandwidth makes of it.
struct Logs {
  Logs() : arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 9), truth(arm.Run(20, 90)) {
    late = calibration::Delayed(truth, 0.008);
  }
  std::string Said(const Dataset& train, const std::vector<const Dataset*>& narrow) const {
    const Diagnosis diagnosis(arm.model(), tests::Records(), {&train}, narrow);
    std::string said;
    for (const Term& t : diagnosis.finding().terms) said += t.record->name + " ";
    return said;
  }
  static Dataset AnotherRun(double seconds) {
    return tests::SyntheticArm(codegen::ReadRobot("codegen/robots/two_link.toml"), 9).Run(seconds, 91);
  }
  tests::SyntheticArm arm;
  Dataset truth, late;
};

TEST(SecondBandwidth, RefusesATermThatIsNotThere) {
  const Logs logs;
  EXPECT_EQ(logs.Said(logs.late, {}), "time_delay ");  // without the guard the derivation's lag is an effect
  EXPECT_EQ(logs.Said(logs.late, {&logs.truth}), "");
}

TEST(SecondBandwidth, KeepsATermThatStays) {
  const Logs logs;
  EXPECT_EQ(logs.Said(logs.late, {&logs.late}), "time_delay ");
  const Dataset still_there = calibration::Delayed(logs.truth, 0.007);  // most of it: more than half of its gain
  EXPECT_EQ(logs.Said(logs.late, {&still_there}), "time_delay ");
}

// The derivation's noise is in the acceleration, and less of it at the lower bandwidth. The positions are clean.
TEST(SecondBandwidth, RefusesWhatOnlyTheNoiseOfTheDerivationShows) {
  const Logs logs;
  Dataset wide = Logs::AnotherRun(80), narrow = wide;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (Eigen::Index k = 0; k < wide.samples(); ++k) {
    const double noise = kNoise_radps2 * normal(random);
    wide.s.qdd(k, 0) += noise, narrow.s.qdd(k, 0) += 0.6 * noise;
  }
  EXPECT_EQ(logs.Said(wide, {}), "belt_elasticity ");
  EXPECT_EQ(logs.Said(wide, {&wide}), "belt_elasticity ");
  EXPECT_EQ(logs.Said(wide, {&narrow}), "");
}

// Two effects on one joint. The narrow log has slow rows alone: friction at low speed keeps its gain there, the ripple
// does not. Instruments below 0.3 Hz lose a part of the true motion. What friction does along that part is no noise.
TEST(SecondBandwidth, KeepsASmallTermBesideALargeOne) {
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 9);
  Dataset wide = arm.Run(40, 93, [](const tests::State& s) {
    if (s.joint != 0) return 0.0;
    return 2 / (1 + std::pow(s.qd / 0.25, 2)) * (s.qd > 0 ? 1 : -1) + 0.3 * std::cos(7 * s.q);
  });
  wide.cutoff_Hz.setConstant(2, 1.5);
  Dataset narrow = wide;
  const double slow = 0.4 * wide.s.qd.col(0).cwiseAbs().maxCoeff();
  narrow.used.col(0).array() *= (wide.s.qd.col(0).array().abs() < slow).cast<int>();
  const std::string said = Logs().Said(wide, {&narrow});
  EXPECT_NE(said.find("torque_ripple"), said.npos) << said;
}

// Lag and delay of both joints, of which the diagnosis is told a little less: at each turn that leaves a peak.
TEST(TorqueChannel, ThatIsALittleWrong_IsNoFrictionAtTurns) {
  const Logs logs;
  Dataset log = Logs::AnotherRun(40);
  log.channel = {{0.02, 0.008, 1}, {0.03, 0.004, 1}};
  log.tau = calibration::ThroughChannel(log, log.tau);
  EXPECT_EQ(logs.Said(log, {}), "");
  for (calibration::JointChannel& c : log.channel) c.late_s -= 0.002;
  EXPECT_EQ(logs.Said(log, {}), "");
}

// The joint turns, and its derived speed changes sign a little too early: until the true turn, friction has the other
// sign. As large a torque in the middle of a sweep is a contact.
TEST(Turn, ThatIsDerivedALittleEarly_IsNoContact) {
  const Logs logs;
  constexpr int kJoint = 1, kLate = 18, kSweep = 60, kMiddle = 40;
  constexpr double kSize_Nm = 1.5;
  const Dataset truth = Logs::AnotherRun(40);
  const auto slides_on = [&](int k) {
    return (truth.s.qd.col(kJoint).segment(k + 1, kSweep).array() * truth.s.qd(k + 1, kJoint) > 0).all();
  };
  int turn = truth.samples() / 2;
  while (truth.s.qd(turn, kJoint) * truth.s.qd(turn + 1, kJoint) > 0 || !slides_on(turn)) ++turn;
  for (const bool at_turn : {true, false}) {
    Dataset log = truth;
    log.cutoff_Hz.setConstant(log.joints(), 3);
    for (int late = 1; late < kLate; ++late)
      log.tau(turn + (at_turn ? 0 : kMiddle) + late, kJoint) -= kSize_Nm * std::sin(std::numbers::pi * late / kLate);
    EXPECT_EQ(logs.Said(log, {}), at_turn ? "" : "external_contact ") << at_turn;
  }
}

// Friction that changes its sign faster than the declared law has no length: it is no presliding, even if nothing else
// may be named. A spring that slips has one.
TEST(Presliding, HasALength) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  robot.sign_law = "tanh", robot.sign_width_radps = 0.1;
  tests::SyntheticArm arm(robot, 9);  // its friction has the sign of speed
  const codegen::Catalogue only{{"presliding_dahl", tests::Records().at("presliding_dahl")}};
  constexpr double kLevel_Nm = 3, kLength_rad = 0.02;
  for (const bool spring : {false, true}) {
    double force = 0, before = 0;
    const Dataset log = arm.Run(40, 92, [&](const tests::State& s) {
      if (s.joint != 1 || !spring) return 0.0;
      force = std::clamp(force + kLevel_Nm * (s.q - before) / kLength_rad, -kLevel_Nm, kLevel_Nm);
      before = s.q;
      return force;
    });
    const Diagnosis diagnosis(arm.model(), only, {&log});
    std::vector<int> named;
    for (const Term& t : diagnosis.finding().terms) named.push_back(t.joints[0]);
    EXPECT_EQ(named, spring ? std::vector<int>{1} : std::vector<int>{});
  }
}

}  // namespace
}  // namespace armcal::diagnosis
