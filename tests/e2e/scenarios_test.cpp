// end-to-end tests - every shipped scenario with one undeclared effect, each on another joint; long.
#include "tests/e2e/demo_run.hpp"

namespace armcal::tests {
namespace {

struct Shipped {
  const char* scenario;
  std::vector<std::string> kinds;
  int joint;
};

class Scenario : public testing::TestWithParam<Shipped> {};

TEST_P(Scenario, Effect_IsNamedFirstAtItsJointAndItsTorqueIsGone) {
  const Shipped& s = GetParam();
  const fs::path folder = FreshFolder(std::string("scenario_") + s.scenario);
  const nlohmann::json result = RunDemo(s.scenario, folder);
  ASSERT_FALSE(result.is_null());
  ExpectSoundLoop(result, folder);
  ExpectFound(result, s.kinds, s.joint);
}

INSTANTIATE_TEST_SUITE_P(All, Scenario,
                         testing::Values(Shipped{"ripple", {"torque_ripple"}, 1}, Shipped{"stribeck", {"stribeck"}, 2},
                                         Shipped{"load_friction", {"load_friction"}, 3},
                                         Shipped{"asymmetry", {"coulomb_asymmetry", "torque_offset"}, 4},
                                         Shipped{"temperature", {"temp_viscous"}, 5},
                                         Shipped{"cable", {"cable_pack", "position_torque"}, 6},
                                         Shipped{"cubic", {"viscous_cubic", "viscous_quadratic"}, 5},
                                         Shipped{"hysteresis", {"hysteresis", "presliding_dahl"}, 1},
                                         Shipped{"current_sensor", {"torque_ripple"}, 2}),
                         [](const auto& shipped) { return std::string(shipped.param.scenario); });

TEST(DemoOfTwoJoints, Closes) {
  for (const std::string scenario : {"wrist", "two_effects"}) {
    const fs::path folder = FreshFolder("scenario_" + scenario);
    const nlohmann::json result = RunDemo(scenario, folder);
    ASSERT_FALSE(result.is_null()) << scenario;
    ExpectSoundLoop(result, folder);
  }
}

// No table can hold a load that comes during the run, so the loop stays open.
TEST(DemoThatStaysOpen, EndsWith6_AndWritesResultAndPageWhole) {
  const fs::path folder = FreshFolder("scenario_payload");
  const nlohmann::json result = RunDemo("payload", folder, 6);
  ASSERT_FALSE(result.is_null());
  EXPECT_FALSE(result.at("closed"));
  ASSERT_EQ(result.at("effects").size(), 1u);
  EXPECT_EQ(result.at("effects")[0].at("became"), "found; no model can hold it");
  EXPECT_EQ(result.at("joints").size(), 6u);
  const std::string page = ReadText(folder / "report.html");
  EXPECT_NE(page.find("The loop did not close"), std::string::npos);
  EXPECT_NE(page.find("</html>"), std::string::npos);
}

}  // namespace
}  // namespace armcal::tests
