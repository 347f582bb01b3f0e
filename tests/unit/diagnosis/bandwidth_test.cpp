// diagnosis tests - check the second bandwidth: what the derivation of the motion leaves is no effect.
#include <gtest/gtest.h>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "host_sim/identify/calibration/dataset.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;

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

}  // namespace
}  // namespace armcal::diagnosis
