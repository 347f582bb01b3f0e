// report tests - the data of live charts are complete, whatever text comes in; the library comes with its licence.
#include "host_sim/data/report/live.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host_sim/data/report/assets.hpp"
#include "host_sim/data/report/page.hpp"

namespace armcal::report {
namespace {

const std::string kHostile = "</script><script>alert(1)</script>'\"&\\\xff";

Live Two(const std::string& text) {
  Live live;
  for (const char* name : {"a", "b"})
    live.panels.push_back({name + text,
                           {{text, text, text},
                            {{"measured" + text, {0, 1, 2}, {1, NAN, 3}}, {text, {0, 1, 2}, {4, 5, INFINITY}}},
                            false,
                            false,
                            {{1.5, text}}}});
  live.difference = text;
  return live;
}

// The data that stand in the page, as a browser reads them.
nlohmann::json Data(const std::string& html) {
  const std::string open = "<script type='application/json' class='charts'>";
  const auto begin = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script", begin) - begin));
}

class LiveTest : public testing::Test {
  void SetUp() override {
    if (assets::kDygraphs.empty()) GTEST_SKIP() << "libjs-dygraphs was not installed when this was configured";
  }
};

TEST_F(LiveTest, HoldsEveryValue_AndNullForWhatIsNoNumber) {
  const nlohmann::json data = Data(Html(Two("x")));
  ASSERT_EQ(data.at("panels").size(), 2u);
  EXPECT_EQ(data["panels"][0]["rows"], nlohmann::json::parse("[[0,1,4],[1,null,5],[2,3,null]]"));
  EXPECT_EQ(data["panels"][1]["series"][0]["name"], "measuredx");
  EXPECT_EQ(data["panels"][1]["shades"][0]["from"], 1.5);
}

TEST_F(LiveTest, HostileText_EndsNoScript) {
  Page page("t");
  page.Add(Two(kHostile), kHostile);
  const std::string html = page.Html();
  EXPECT_EQ(html.find("alert(1)</script>"), html.npos);
  EXPECT_EQ(html.find("<script>alert"), html.npos);
  const std::string name = Data(html).at("panels")[0]["name"];
  EXPECT_EQ(name.substr(0, 10), "a</script>");  // the reader sees what was written
}

TEST_F(LiveTest, APeakOfOneRowStays_OfASeriesAndOfADifference) {
  Live live{{{"joint", {{}, {{"measured", {}, {}}, {"predicted", {}, {}}}}}}, "left"};
  auto& series = live.panels[0].plot.series;
  for (int k = 0; k < 200000; ++k) {
    for (Series& s : series) s.x.push_back(k), s.y.push_back(k % 1000);
  }
  series[0].y[77777] = 5000;
  series[1].y[120400] = 450;  // no extreme of its own stretch: only the difference shows it
  const nlohmann::json rows = Data(Html(live)).at("panels")[0]["rows"];
  EXPECT_LT(rows.size(), 40000u);
  const auto has = [&](double x) {
    return std::any_of(rows.begin(), rows.end(), [x](const auto& row) { return row[0] == x; });
  };
  EXPECT_TRUE(has(77777));
  EXPECT_TRUE(has(120400));
}

TEST_F(LiveTest, APageWithCharts_HoldsTheLibraryAndItsLicenceOnce) {
  Page page("t");
  page.Add(Two("x"));
  page.Add(Two("y"));
  const std::string html = page.Html(), licence = "Permission is hereby granted, free of charge";
  const auto first = html.find(licence);
  ASSERT_NE(first, html.npos);
  EXPECT_EQ(html.find(licence, first + 1), html.npos);
  EXPECT_NE(html.find("Dygraph"), html.npos);
  EXPECT_EQ(html.find("sourceMappingURL"), html.npos);  // a browser would ask for that file
  EXPECT_EQ(Page("t").Html().find("Dygraph"), std::string::npos);
  // Neither text may end what it stands in.
  EXPECT_EQ(assets::kDygraphsLicence.find("*/"), std::string_view::npos);
  for (const std::string_view text : {assets::kDygraphs, assets::kDygraphsLicence, assets::kLiveScript})
    EXPECT_EQ(text.find("</script"), text.npos);
}

TEST_F(LiveTest, SeriesThatDifferInX_AreRefused) {
  const Live live{{{"p", {{}, {{"a", {0, 1}, {0, 1}}, {"b", {0, 2}, {0, 1}}}}}}};
  EXPECT_THROW(Html(live), std::invalid_argument);
}

TEST(Live, WithoutJavaScript_ShowsAPictureOfEachPanel) {
  const std::string html = Html(Two("x"));
  const auto first = html.find("<svg ");
  ASSERT_NE(first, html.npos);
  EXPECT_NE(html.find("<svg ", first + 1), html.npos);
}

}  // namespace
}  // namespace armcal::report
