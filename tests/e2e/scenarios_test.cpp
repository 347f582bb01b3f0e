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
                                         Shipped{"cubic", {"viscous_cubic", "viscous_quadratic"}, 5}),
                         [](const auto& shipped) { return std::string(shipped.param.scenario); });

}  // namespace
}  // namespace armcal::tests
