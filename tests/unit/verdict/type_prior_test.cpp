// verdict tests - arms of one type: a drawn fleet, and one arm that is odd.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <fstream>
#include <random>

#include "host_sim/diagnose/verdict/summary.hpp"
#include "host_sim/diagnose/verdict/type_prior.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::verdict {
namespace {

using nlohmann::ordered_json;

// Friction of two joints; the arms differ by 5 %, and a log tells it to 1 %.
ordered_json VerdictOf(const std::string& robot, double first_Nm, double second_Nm) {
  ordered_json v{{"verdict", "none"}, {"robot", robot}, {"terms", ordered_json::array()}};
  v["before_moving"] = v["after_moving"] = {1.0, 1.0};
  v["declared_parameters"] = {{{"name", "Fc1"}, {"unit", "N*m"}, {"value", first_Nm}, {"sd", 0.1}},
                              {{"name", "Fc2"}, {"unit", "N*m"}, {"value", second_Nm}, {"sd", 0.02}}};
  return v;
}

Verdicts Fleet(int arms) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Verdicts out;
  for (int k = 0; k < arms; ++k)
    out[fmt::format("arm{}", k)] = VerdictOf("a", 10 + 0.5 * normal(random), 2 + 0.1 * normal(random));
  return out;
}

TEST(TypesJson, MedianAndSpread_AreThoseOfTheDraw) {
  const ordered_json types = TypesJson(Fleet(400));
  ASSERT_EQ(types.size(), 1u);
  EXPECT_EQ(types[0]["logs"], 400);
  const ordered_json& first = types[0]["parameters"][0];
  EXPECT_EQ(first["name"], "Fc1");
  EXPECT_NEAR(first["median"].get<double>(), 10, 0.15);  // five deviations of a median of 400
  EXPECT_NEAR(first["spread"].get<double>(), 0.5, 0.15);
}

TEST(FarFromType, NamesTheOddArm_AndNoOther) {
  Verdicts fleet = Fleet(40);
  fleet["worn"] = VerdictOf("a", 18, 2);
  fleet["another robot"] = VerdictOf("b", 99, 99);
  fleet["failed"] = FailedVerdict("no rows");
  const ordered_json types = TypesJson(fleet);
  for (const auto& [name, verdict] : fleet) {
    const ordered_json far = FarFromType(types, verdict);
    ASSERT_EQ(far.size(), name == "worn" ? 1u : 0u) << name;
    if (far.empty()) continue;
    EXPECT_EQ(far[0]["parameter"], "Fc1");
    EXPECT_NEAR(far[0]["deviations"].get<double>(), 8 / std::hypot(0.5, 0.1), 6);
  }
}

// What a log cannot tell is no reason to call its arm odd.
TEST(FarFromType, OfAValueThatTheLogHardlyTells_SaysNothing) {
  const ordered_json types = TypesJson(Fleet(40));
  ordered_json verdict = VerdictOf("a", 18, 2);
  verdict["declared_parameters"][0]["sd"] = 4.0;
  EXPECT_TRUE(FarFromType(types, verdict).empty());
}

TEST(TypesJson, OfFourLogs_IsNone) { EXPECT_TRUE(TypesJson(Fleet(4)).empty()); }

TEST(SummaryPage, LinksTheLogsThatHaveAPage) {
  const files::test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "pages");
  folder.Write("pages/arm 1 & 2.html", "");
  const ordered_json summary = SummaryJson({{"arm 1 & 2", VerdictOf("a", 1, 1)}, {"arm3", VerdictOf("a", 1, 1)}});
  WriteSummaryPage(folder / "all.html", summary, folder / "pages");
  std::ifstream file(folder / "all.html");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(page.find("<a href='pages/arm%201%20%26%202.html'>arm 1 &amp; 2</a>"), page.npos);
  EXPECT_EQ(page.find("arm3.html"), page.npos);
}

}  // namespace
}  // namespace armcal::verdict
