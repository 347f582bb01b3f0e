// bench tests - what armcal bench writes, and that it compares like with like. No test judges a time.
#include <gtest/gtest.h>
#include <fstream>

#include <cmath>
#include <set>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

const nlohmann::json& Quick() {
  static const nlohmann::json result = [] {
    const fs::path file = FreshFolder("bench") / "bench.json";
    const Outcome o = Tool({"bench", "--quick", "--json", file.string()});
    if (o.code != 0) throw std::runtime_error(o.err);
    return ReadJson(file);
  }();
  return result;
}

TEST(Bench, Ratios_HaveNameValueGoalAndVerdict) {
  std::set<std::string> names;
  for (const auto& r : Quick().at("ratios")) {
    names.insert(r.at("name").get<std::string>());
    const double value = r.at("value").get<double>(), goal = r.at("goal").get<double>();
    EXPECT_TRUE(std::isfinite(value) && value > 0) << r;
    EXPECT_GT(goal, 0) << r;
    EXPECT_EQ(r.at("met").get<bool>(), value <= goal) << r;
    EXPECT_LE(r.at("stretch").get<double>(), goal) << r;
    EXPECT_EQ(r.at("stretch_met").get<bool>(), value <= r.at("stretch").get<double>()) << r;
  }
  for (const char* wanted :
       {"regressor_over_kdl_rne", "regressor_over_six_sincos", "batch_over_normal_equations", "batch_over_householder"})
    EXPECT_TRUE(names.contains(wanted)) << wanted;
  EXPECT_EQ(names.size(), Quick().at("ratios").size());
}

TEST(Bench, Times_AreOrderedQuantilesOfAllBlocks) {
  for (const auto& t : Quick().at("times")) {
    EXPECT_GT(t.at("blocks").get<int>(), 0) << t;
    EXPECT_GT(t.at("min_ns").get<double>(), 0) << t;
    EXPECT_LE(t.at("min_ns").get<double>(), t.at("median_ns").get<double>()) << t;
    EXPECT_LE(t.at("median_ns").get<double>(), t.at("p90_ns").get<double>()) << t;
  }
}

// The model that is timed moves as KDL's arm does, and the three least-squares programs find the same parameters.
TEST(Bench, WhatIsCompared_ComputesTheSame) {
  EXPECT_LT(Quick().at("torque_differs_from_kdl").get<double>(), 1e-6);  // bodies and map are float in the header
  EXPECT_LT(Quick().at("estimates_differ").get<double>(), 1e-10);        // condition of random rows below 1e4
  EXPECT_TRUE(Quick().at("quick").get<bool>());
}

TEST(Bench, RobotWithoutAProgram_IsNamed) {
  ExpectOneLine(Tool({"bench", "--robot", "two_link"}), 2,
                "no bench program has been built for robot two_link; there is one for ");
}

// Another arm's kinematics under er20_like's name: the program must notice that it compares two arms.
TEST(Bench, AnotherArmsKinematics_AreNotCompared) {
  const fs::path folder = FreshFolder("bench_other");
  std::string text = ReadText("codegen/robots/er20_like.toml");
  const auto at = text.find("a_m = 0.170");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 11, "a_m = 0.270");
  std::ofstream(folder / "other.toml") << text;
  ExpectOneLine(Tool({"bench", "--quick", "--robot", (folder / "other.toml").string()}), 2,
                "its model is not that of er20_like; build it for this robot file");
}

}  // namespace
}  // namespace armcal::tests
