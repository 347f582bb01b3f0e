// diagnosis tests - check the second bandwidth: what the derivation of the motion leaves is no effect.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace armcal::diagnosis
