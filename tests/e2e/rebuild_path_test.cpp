// end-to-end tests - the loop in which the model is generated anew and the drive rebuilt; with a stranger's scenario.
#include "tests/e2e/demo_run.hpp"

namespace armcal::tests {
namespace {

class RebuildPath : public testing::Test {
 protected:
  // The build folder forgets the model of this test, whose files may be gone the next time somebody builds.
  void TearDown() override {
    EXPECT_EQ(RunProgram({"cmake", "-S", ".", "-B", ARMCAL_BUILD_FOLDER, "-UARMCAL_MODEL", "-UARMCAL_MODEL_NAME"}).code,
              0);
  }
};

TEST_F(RebuildPath, Stribeck_IsFoundGeneratedBuiltAndFlashed) {
  const fs::path folder = FreshFolder("stribeck");
  const nlohmann::json result = RunDemo("stribeck", folder);
  ASSERT_FALSE(result.is_null());
  ExpectSoundLoop(result, folder);
  ExpectFound(result, {"stribeck"}, 2);
  EXPECT_FALSE(result.at("model").at("by_table").get<bool>());
  EXPECT_TRUE(fs::exists(folder / "generated" / "model.hpp"));
}

// Written here, never shipped: whoever tuned the product on the shipped scenarios has not seen it.
TEST_F(RebuildPath, AStrangersScenario_IsServedLikeTheShippedOnes) {
  const fs::path folder = FreshFolder("stranger");
  const fs::path scenario = folder / "stranger.toml";
  std::ofstream(scenario) << R"(title = "churning in joint 4 of another arm"
robot = "er20_like"
truth_seed = 90210
noise_seed = 4711

[[effect]]
kind = "viscous_cubic"
joint = 4
drag_at_1radps_Nm = 0.22
exponent = 2.8
)";
  const nlohmann::json result = RunDemo(scenario.string(), folder);
  ASSERT_FALSE(result.is_null());
  ExpectSoundLoop(result, folder);
  ExpectFound(result, {"viscous_cubic", "viscous_quadratic"}, 4);
  EXPECT_EQ(result.at("title"), "churning in joint 4 of another arm");
}

}  // namespace
}  // namespace armcal::tests
