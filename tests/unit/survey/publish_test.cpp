// survey tests - findings as JSON and HTML have the form that programs rely on.
#include "host_sim/study/survey/publish.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

Findings Small() {
  Findings f;
  f.sheets.push_back({"8",
                      "errors",
                      {"method", "e_d", "e_f", "remark"},
                      {{"pinv", 65.5, Cell(0.1, 0.08, 0.12), std::nan("")}},
                      {"a note"}});
  f.goals = {{"small enough", 0.1, 0.2, true}, {"large enough", 0.1, 0.2, false}, {"no number", std::nan(""), 1, true}};
  Picture p;
  p.number = "3", p.title = "platform <1>", p.drawing = "<svg viewBox='0 0 1 1'></svg>";
  f.pictures.push_back(p);
  return f;
}

TEST(SurveyJson, HoldsRowsByColumnAndEveryGoal) {
  const auto j = nlohmann::json::parse(Json(Small(), {}));
  const auto& row = j["tables"]["8"]["rows"][0];
  EXPECT_EQ(row["method"], "pinv");
  EXPECT_EQ(row["e_d"], 65.5);
  EXPECT_EQ(row["e_f"]["mean"], 0.1);
  EXPECT_EQ(row["e_f"]["high"], 0.12);
  EXPECT_TRUE(row["remark"].is_null());  // a number that does not exist is no zero
  ASSERT_EQ(j["goals"].size(), 3u);
  EXPECT_EQ(j["goals"][0]["met"], true);
  EXPECT_EQ(j["goals"][0]["name"], "small enough");
  EXPECT_EQ(j["goals"][0]["value"], 0.1);
  EXPECT_EQ(j["goals"][0]["goal"], 0.2);
  EXPECT_EQ(j["goals"][1]["met"], false);
  EXPECT_EQ(j["goals"][2]["met"], false) << "a goal without a number is not met";
}

TEST(SurveyPage, ContainsTablesGoalsAndDrawings_Escaped) {
  const std::string html = Html(Small(), {});
  for (const char* part : {"small enough", "65.5", "0.100 ± 0.020", "<svg viewBox='0 0 1 1'>", "platform &lt;1&gt;"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  EXPECT_LT(html.find("<svg viewBox='0 0 1 1'>"), html.find("</main>"));
}

TEST(SurveyText, NamesTheGoalsThatAreNotMet) {
  const std::string text = GoalLines(Small());
  EXPECT_NE(text.find("goals met: 1 of 3"), std::string::npos);
  EXPECT_NE(text.find("large enough"), std::string::npos);
  EXPECT_EQ(text.find("small enough"), std::string::npos);
}

TEST(SurveyTables, Slips_AreListedWithWhatIsDoneInstead) {
  const Sheet slips = Slips();
  for (const auto& row : slips.rows) EXPECT_EQ(row.size(), slips.columns.size());
  EXPECT_GE(slips.rows.size(), 6u);  // those that the text of the survey contradicts itself in
}

}  // namespace
}  // namespace armcal::survey
