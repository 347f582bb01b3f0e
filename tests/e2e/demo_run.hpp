// end-to-end tests - run the closed loop once, and check what every such run must give.
#pragma once

#include <algorithm>
#include <regex>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {

// Runs the demo into a fresh folder; `scenario` is a name or a file, `code` the exit code that it must have. Returns
// result.json, null if the run failed. What it compiles is kept for other tests, not in the user's cache.
inline nlohmann::json RunDemo(const std::string& scenario, const fs::path& folder, int code = 0) {
  setenv("XDG_CACHE_HOME", ARMCAL_E2E_FOLDER "/cache", 1);
  const Outcome o = Tool({"demo", "--scenario", scenario, "--out", folder.string(), "--excite-starts", "6"});
  EXPECT_EQ(o.code, code) << o.err << o.out;
  if (o.code != code) return {};
  return ReadJson(folder / "result.json");
}

inline std::vector<double> List(const nlohmann::json& result, const char* key) {
  return result.at(key).get<std::vector<double>>();
}

inline double SquareSum(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return sum;
}

// The link kept its word, the page needs no network, identification beat the CAD values, and the held-out error is at
// the floor that the plant itself sets.
inline void ExpectSoundLoop(const nlohmann::json& result, const fs::path& folder) {
  EXPECT_TRUE(result.at("closed").get<bool>());
  EXPECT_TRUE(result.at("readback_ok").get<bool>());
  EXPECT_TRUE(result.at("estimate_same_bits").get<bool>());
  const std::string page = ReadText(folder / "report.html");
  EXPECT_GT(page.size(), 10000u);
  EXPECT_FALSE(std::regex_search(page, std::regex("(src|href)\\s*=\\s*[\"']?\\s*(https?:)?//", std::regex::icase)));
  EXPECT_EQ(page.find("@import"), std::string::npos);
  const auto after = List(result, "after_moving"), floor = List(result, "plant_floor");
  for (std::size_t j = 0; j < floor.size(); ++j) EXPECT_LE(after[j], 1.10 * floor[j]) << "joint " << j + 1;
  EXPECT_LT(SquareSum(List(result, "drive_before")), 0.25 * SquareSum(List(result, "drive_cad")));
}

// With the terms in the drive, four fifths of what the plant's noise leaves unexplained at this joint are gone.
inline void ExpectExcessGone(const nlohmann::json& result, int joint) {
  const auto excess = [&](const char* drive, const char* floor) {
    const double d = List(result, drive).at(joint - 1), f = List(result, floor).at(joint - 1);
    return d * d - f * f;
  };
  const double before = excess("drive_before", "plant_floor"), after = excess("drive_after", "plant_floor_after_run");
  std::printf("joint %d: squared excess over the floor %.4g before, %.4g after: %.1f %% left\n", joint, before, after,
              100 * after / before);
  EXPECT_LE(after, 0.2 * before);
}

// The strongest term names one of `kinds` (or says that it cannot be told from one) at `joint`, counted from 1; with
// it in the drive, the excess there is gone.
inline void ExpectFound(const nlohmann::json& result, const std::vector<std::string>& kinds, int joint) {
  EXPECT_EQ(result.at("verdict"), "effect");
  ASSERT_FALSE(result.at("terms").empty());
  const nlohmann::json& term = result.at("terms")[0];
  std::vector<std::string> said = term.at("also_fits").get<std::vector<std::string>>();
  said.push_back(term.at("kind"));
  EXPECT_LE(said.size(), 3u);
  EXPECT_TRUE(std::any_of(said.begin(), said.end(), [&](const std::string& s) {
    return std::find(kinds.begin(), kinds.end(), s) != kinds.end();
  })) << term;
  EXPECT_EQ(term.at("joint"), joint) << term;
  EXPECT_TRUE(term.at("confirmed").get<bool>());
  ExpectExcessGone(result, joint);
}

}  // namespace armcal::tests
