// end-to-end tests - change an arm while it works: armcal health names the joint, armcal learning holds and resets.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

// The arm is as its file says until 200 s of motion; then three joints change.
constexpr double kChange_s = 200;
constexpr const char* kScenario = R"(
title = "joints that change while the arm works"
robot = "er20_like"
truth_seed = 1
noise_seed = 1

[truth]
inertial_spread = 0
friction_spread = 0
torque_constant_spread = 0

[[effect]]            # thicker grease: + 15 N*m*s/rad
kind = "viscous_cubic"
joint = 3
from_s = 200
drag_at_1radps_Nm = 15.0
exponent = 1.0

[[effect]]            # a tighter seal: Coulomb friction x 1.3
kind = "coulomb_asymmetry"
joint = 2
from_s = 200
forward_ratio = 1.3
backward_ratio = 1.3

[[effect]]            # a damaged tooth: far too fine for any bin
kind = "torque_ripple"
joint = 5
from_s = 200
per_motor_turn = 1.0
first_Nm = 2.0
)";

// 62 s in several tones, from rest to rest.
fs::path WriteMotion(const fs::path& path) {
  const double seconds = 62, size[] = {1.0, 0.6, 0.6, 1.0, 0.8, 1.2}, f[] = {0.13, 0.17, 0.21, 0.25, 0.29, 0.33};
  std::ofstream out(path);
  out << "t,q1,q2,q3,q4,q5,q6\n";
  out.precision(13);
  for (int k = 0; k * 0.008 <= seconds; ++k) {
    const double t = k * 0.008, u = std::min({1.0, t / 3, std::max(0.0, (seconds - t) / 3)});
    out << t;
    for (int j = 0; j < 6; ++j)
      out << ',' << u * u * u * (10 + u * (6 * u - 15)) * size[j] * std::sin(2 * std::numbers::pi * f[j] * t);
    out << '\n';
  }
  return path;
}

class Health : public testing::Test {
 protected:
  void Work(int times) {
    for (int k = 0; k < times; ++k) {
      const Outcome o = Tool({"record", "--connect", drive_.address(), "--robot", "er20_like", "--trajectory",
                              motion_.string(), "--decimation", "16", "--out", (folder_ / "log.csv.gz").string()});
      ASSERT_EQ(o.code, 0) << o.err;
    }
  }
  Outcome Ask() {
    Outcome o = Tool({"health", "--connect", drive_.address(), "--json", (folder_ / "health.json").string()});
    json_ = ReadJson(folder_ / "health.json");
    return o;
  }
  const nlohmann::json& Joint(int number) const { return json_.at("joints").at(static_cast<std::size_t>(number - 1)); }

  static fs::path WriteScenario(const fs::path& path) {
    std::ofstream(path) << kScenario;
    return path;
  }

  fs::path folder_ = FreshFolder("health");
  fs::path motion_ = WriteMotion(folder_ / "motion.csv");
  RunningDrive drive_{folder_, WriteScenario(folder_ / "changes.toml").string()};
  nlohmann::json json_;
};

TEST_F(Health, OfAnArmThatChanges_NamesJointCauseAndTime_AndSaysWhatItCannotTell) {
  EXPECT_EQ(Ask().code, 6);  // nothing has moved yet
  EXPECT_EQ(Joint(1).at("verdict"), "too_early");

  Work(3);  // to about 190 s: still healthy
  const Outcome healthy = Ask();
  ASSERT_LT(json_.at("elapsed_s").get<double>(), kChange_s);
  EXPECT_EQ(healthy.code, 0) << healthy.out;
  for (const auto& joint : json_.at("joints")) EXPECT_EQ(joint.at("verdict"), "fits") << joint;

  Work(4);
  const Outcome ill = Ask();
  std::printf("%s", ill.out.c_str());
  EXPECT_EQ(ill.code, 5) << ill.err;
  for (const int joint : {1, 4, 6}) EXPECT_EQ(Joint(joint).at("verdict"), "fits") << Joint(joint);
  const double age_s = json_.at("elapsed_s").get<double>() - kChange_s;
  for (const int joint : {2, 3, 5}) {
    EXPECT_EQ(Joint(joint).at("verdict"), "no_longer_fits") << Joint(joint);
    EXPECT_NEAR(Joint(joint).at("since_s").get<double>(), age_s, 16) << Joint(joint);  // two slices of 8 s
    EXPECT_LE(Joint(joint).at("since_between_s").at(0), age_s + 1);                    // times are whole seconds
    EXPECT_GE(Joint(joint).at("since_between_s").at(1), age_s - 1);
  }
  const auto only_term = [&](int joint) -> nlohmann::json {
    const auto& terms = Joint(joint).at("looks_like");
    EXPECT_EQ(terms.size(), 1u) << Joint(joint);
    return terms.empty() ? nlohmann::json{{"kind", ""}, {"parameter", ""}, {"change", 0}} : terms.at(0);
  };
  // The latest rows still remember a little of the healthy time: up to a tenth is missing.
  EXPECT_EQ(only_term(3).at("parameter"), "Fv");
  EXPECT_NEAR(only_term(3).at("change").get<double>(), 15, 2);
  EXPECT_EQ(only_term(2).at("parameter"), "Fc");
  EXPECT_NEAR(only_term(2).at("change").get<double>(), 0.3 * 60, 2.5);
  EXPECT_TRUE(Joint(5).at("looks_like").empty()) << Joint(5);
  EXPECT_NE(ill.out.find("armcal record"), std::string::npos);
}

TEST_F(Health, LearningOnHold_UsesNoRow_AndABlockIsReset) {
  const auto ask = [&](std::vector<std::string> words) {
    const std::string json = (folder_ / "learning.json").string();
    words.insert(words.begin(), {"learning", "--connect", drive_.address(), "--json", json});
    const Outcome o = Tool(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return ReadJson(json);
  };
  EXPECT_EQ(ask({}).at("held"), false);
  EXPECT_EQ(ask({"--hold"}).at("held"), true);
  Work(1);
  for (const auto& filter : ask({}).at("filters")) {
    EXPECT_EQ(filter.at("rows_used"), 0);
    EXPECT_GT(filter.at("rows_gated"), 0);
  }
  EXPECT_EQ(ask({"--resume"}).at("held"), false);
  Work(1);
  const auto after = ask({"--reset", "bodies"});
  for (const auto& filter : after.at("filters")) EXPECT_GT(filter.at("rows_used"), 0);
  EXPECT_EQ(after.at("consistency").size(), 6u);
  EXPECT_EQ(ask({"--reset", "6", "--hold"}).at("reset"), "6");
  for (const char* wrong : {"0", "7", "01", "links"})
    ExpectOneLine(Tool({"learning", "--connect", drive_.address(), "--reset", wrong}), 2, "from 1 to 6, or bodies");
  EXPECT_EQ(Tool({"learning", "--connect", drive_.address(), "--hold", "--resume"}).code, 2);
}

TEST(SerialLine, ThatIsNone_IsBadInput) {
  for (const char* wrong : {"/dev/null:12", "/dev/null:9600:M", "/dev/null:9600:EE", "/dev/null:9600:E:300",
                            "/dev/null:9600:E:1:1", "/dev/null:"})
    ExpectOneLine(Tool({"health", "--connect", wrong}), 2, "300 to 12000000 baud");
}

}  // namespace
}  // namespace armcal::tests
