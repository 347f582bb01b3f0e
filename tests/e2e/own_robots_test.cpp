// end-to-end tests - three arms that armcal was not built with: import, excite, simulate, record, identify, diagnose.
#include <algorithm>

#include "tests/e2e/own_drive.hpp"

namespace armcal::tests {
namespace {

struct Undeclared {
  std::string effect;  // of the scenario
  std::vector<std::string> kinds;
  int joint;
};

class OwnRobots : public OwnDrive {
 protected:
  nlohmann::json Verdict(const std::string& scenario) {
    {
      const RunningDrive drive(folder_, scenario, {"--robot", Robot()});
      for (const char* motion : {"train", "test"}) Recorded(drive, motion);
    }
    const Outcome o = Tool({"diagnose", "--robot", Robot(), "--train", Path("train_log.csv.gz"), "--test",
                            Path("test_log.csv.gz"), "--json", Path("verdict.json")});
    EXPECT_EQ(o.code, 0) << o.err << o.out;
    return o.code == 0 ? ReadJson(Path("verdict.json")) : nlohmann::json();
  }

  void Through(const ImportedArm& arm, int seed, const Undeclared& undeclared) {
    ASSERT_NO_FATAL_FAILURE(Imported(arm));
    const Outcome generated = Tool({"generate", "--robot", Robot(), "--out", Path("generated")});
    ASSERT_EQ(generated.code, 0) << generated.err;
    ASSERT_NO_FATAL_FAILURE(Excited());
    const nlohmann::json none = Verdict(Scenario("nothing.toml", seed));
    ASSERT_FALSE(none.is_null());
    EXPECT_EQ(none.at("verdict"), "none") << none.at("terms").dump();
    const Outcome fit = Tool({"identify", "--robot", Robot(), "--train", Path("train_log.csv.gz"), "--test",
                              Path("test_log.csv.gz"), "--json", Path("fit.json")});
    ASSERT_EQ(fit.code, 0) << fit.err;
    const nlohmann::json held_out = ReadJson(Path("fit.json")).at("held_out").at("rms_moving");
    // The guessed noise of one tick is 0.5 % of the torque limit; a sample averages eight. The bound is not 1.05: where
    // a joint sticks at a turn, the jerk reaches the rows of other joints. Without friction it is 1.01.
    for (std::size_t j = 0; j < arm.joints.size(); ++j)
      EXPECT_LE(held_out[j].get<double>(), 1.2 * 0.005 * arm.joints[j].torque / std::sqrt(8.0)) << "joint " << j + 1;

    const nlohmann::json found = Verdict(Scenario("one_effect.toml", seed + 10, undeclared.effect));
    ASSERT_FALSE(found.is_null());
    std::vector<nlohmann::json> confirmed;
    for (const auto& t : found.at("terms"))
      if (t.at("confirmed").get<bool>()) confirmed.push_back(t);
    // The simulated drive's laws have other forms than the records. So a further term on the same joint may hold the
    // rest.
    bool named = false;
    for (const nlohmann::json& term : confirmed) {
      EXPECT_EQ(term.at("joint"), undeclared.joint) << term.at("kind");
      named |= std::count(undeclared.kinds.begin(), undeclared.kinds.end(), term.at("kind").get<std::string>()) > 0;
    }
    EXPECT_TRUE(named) << confirmed.size() << " terms";
  }
};

TEST_F(OwnRobots, AScara_GoesThrough) {
  Through(Scara(), 21,
          {"[[effect]]\nkind = \"viscous_cubic\"\njoint = 2\ndrag_at_1radps_Nm = 0.012\nexponent = 2.6\n",
           {"viscous_cubic", "viscous_quadratic"},
           2});
}

TEST_F(OwnRobots, AGantry_GoesThrough) {
  Through(
      Gantry(), 22,
      {"[[effect]]\nkind = \"torque_ripple\"\njoint = 2\nper_motor_turn = 60\nfirst_Nm = 4\n", {"torque_ripple"}, 2});
}

TEST_F(OwnRobots, AnArmWithAGripper_GoesThrough) {
  Through(WithGripper(), 23,
          {"[[effect]]\nkind = \"stribeck\"\njoint = 3\nexcess_Nm = 1.5\nspeed_radps = 0.15\n", {"stribeck"}, 3});
}

}  // namespace
}  // namespace armcal::tests
