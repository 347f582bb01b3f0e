// fleet tests - what a store keeps, and the log at which a planted change is named.
#include <gtest/gtest.h>

#include <random>

#include "host_sim/diagnose/fleet/history.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::fleet {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;
using nlohmann::ordered_json;

std::string Date(int log) {
  return "2026-" + std::string(log < 9 ? "0" : "") + std::to_string(log + 1) + "-01T00:00:00Z";
}

// A verdict with one friction value, an error of two joints, and perhaps a payload and a term.
Entry Verdict(int log, double friction, double error, double payload = 0, const std::string& term = "",
              double sd = 0.2) {
  ordered_json j{{"verdict", term.empty() ? "none" : "effect"}, {"terms", ordered_json::array()}};
  if (!term.empty()) j["terms"].push_back({{"confirmed", true}, {"record", term}, {"joints", {2}}});
  j["terms"].push_back({{"confirmed", false}, {"record", "refuted"}, {"joints", {1}}});
  j["declared_parameters"] = {{{"name", "Fc1"}, {"unit", "N*m"}, {"value", friction}, {"sd", sd}}};
  j["payload"] = payload == 0 ? ordered_json() : ordered_json{{"mass_kg", payload}, {"mass_sd_kg", 0.05}};
  j["after_moving"] = {error, 2.0};
  j["moving_share"] = {0.9, 0.8};
  return {"arm", Date(log), "hash" + std::to_string(log), j.dump()};
}

std::vector<Entry> Months(int count, const std::function<void(int, double&, double&, double&, std::string&)>& change) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  std::vector<Entry> entries;
  for (int k = 0; k < count; ++k) {
    double friction = 10 + 0.2 * normal(random), error = 1 + 0.02 * normal(random), payload = 0;
    std::string term;
    change(k, friction, error, payload, term);
    entries.push_back(Verdict(k, friction, error, payload, term));
  }
  return entries;
}

std::vector<std::string> Changes(const std::vector<Entry>& entries) {
  std::vector<std::string> found;
  for (const Change& c : HistoryOf(entries).change) found.push_back(std::to_string(c.log) + " " + c.name);
  return found;
}

using Found = std::vector<std::string>;

TEST(History, PlantedChange_IsNamedAtItsLog_AndNothingElse) {
  EXPECT_EQ(Changes(Months(12, [](int, double&, double&, double&, std::string&) {})), Found());
  for (int at = 1; at < 12; ++at) {
    EXPECT_EQ(Changes(Months(
                  12, [&](int k, double& friction, double&, double&, std::string&) { friction += k >= at ? 3 : 0; })),
              Found{std::to_string(at) + " Fc1"});
    EXPECT_EQ(
        Changes(Months(12, [&](int k, double&, double& error, double&, std::string&) { error *= k >= at ? 1.5 : 1; })),
        Found{std::to_string(at) + " error of joint 1"});
    EXPECT_EQ(
        Changes(Months(12, [&](int k, double&, double&, double& payload, std::string&) { payload = k >= at ? 2 : 0; })),
        Found{std::to_string(at) + " payload"});
    EXPECT_EQ(
        Changes(Months(12, [&](int k, double&, double&, double&, std::string& term) { term = k >= at ? "belt" : ""; })),
        Found{std::to_string(at) + " found: belt 2; before: nothing"});
  }
  // There and back: two changes.
  EXPECT_EQ(Changes(Months(12, [](int k, double& friction, double&, double&,
                                  std::string&) { friction += k == 5 || k == 6 ? 3 : 0; })),
            (Found{"5 Fc1", "7 Fc1"}));
}

TEST(History, OfValuesThatAreAsUncertainAsTheyScatter_NamesNothing) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<Entry> entries;
  for (int k = 0; k < 12; ++k) entries.push_back(Verdict(k, 10 + normal(random), 1, 0, "", 1));
  EXPECT_EQ(Changes(entries), Found());
}

TEST(History, OfALogInWhichAJointRests_TakesNoErrorOfIt) {
  std::vector<Entry> entries = Months(6, [](int, double&, double&, double&, std::string&) {});
  ordered_json rests = ordered_json::parse(entries[3].json);
  rests["after_moving"][0] = 0, rests["moving_share"][0] = 0;
  entries[3].json = rests.dump();
  EXPECT_EQ(Changes(entries), Found());
}

TEST(History, OfAFailedVerdict_LeavesItOut_AndOfAnotherTextSaysSo) {
  std::vector<Entry> entries = Months(3, [](int, double&, double&, double&, std::string&) {});
  entries.push_back({"arm", Date(4), "x", R"({"verdict": "failed", "error": "no log"})"});
  EXPECT_EQ(HistoryOf(entries).entry.size(), 3U);
  EXPECT_EQ(HistoryOf(entries).failed, 1);
  EXPECT_NE(HistoryText(HistoryOf(entries)).find("without a verdict: 1 logs"), std::string::npos);
  entries.push_back({"arm", Date(5), "y", R"({"verdict": "none"})"});
  EXPECT_NE(ErrorOf([&] { HistoryOf(entries); }).find(Date(5)), std::string::npos);
}

TEST(History, OfTablesAndReadings_NamesThemByDate_AlsoWithoutALog) {
  const std::string ill = R"({"verdict": "misfit", "joints": [{"joint": 1, "verdict": "fits"},
                              {"joint": 2, "verdict": "no_longer_fits"}, {"joint": 6, "verdict": "never_fitted"}]})";
  const History history =
      HistoryOf({}, {{"arm", Date(1), "00C0FFEE", R"({"by": "flash", "words": [1, 2]})"}},
                {{"arm", Date(2), "00C0FFEE", ill}, {"arm", Date(0), "0", R"({"verdict": "fits", "joints": []})"}});
  ASSERT_EQ(history.event.size(), 3U);
  EXPECT_EQ(history.event[0].what, "health under table 0: all joints fit");
  EXPECT_EQ(history.event[1].what, "table 00C0FFEE by armcal flash");
  EXPECT_EQ(history.event[2].what, "health under table 00C0FFEE: joints that do not fit: 2, 6");
  EXPECT_EQ(HistoryJson(history).at("drive")[1].at("words"), ordered_json({1, 2}));
  const TemporaryFolder folder;
  WriteHistoryPage(folder / "page.html", "arm", history);
  EXPECT_NE(files::test::ReadBytes(folder / "page.html").find("00C0FFEE"), std::string::npos);
  EXPECT_NE(ErrorOf([&] { HistoryOf({}, {{"arm", Date(3), "0", "{}"}}); }).find(Date(3)), std::string::npos);
}

class StoreTest : public testing::Test {
 protected:
  void SetUp() override {
    if (ErrorOf([&] { Keep(file_, Kind::kTable, {}); }).find("without SQLite") != std::string::npos)
      GTEST_SKIP() << "built without SQLite";
  }
  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "fleet.sqlite";
};

TEST_F(StoreTest, KeepsEntriesByArmAndDate_AndReplacesThoseOfTheSameLog) {
  Keep(file_, Kind::kVerdict,
       {{"b", "2026-03", "h3", "{3}"}, {"a", "2026-02", "h2", "{2}"}, {"b", "2026-01", "h1", std::string("{\0}", 3)}});
  Keep(file_, Kind::kVerdict, {{"b", "2026-03", "h3", "{33}"}, {"b", "2026-02", "h4", "{4}"}});
  const std::vector<Entry> entries = EntriesOf(file_, Kind::kVerdict, "b");
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[0].hash, "h1");
  EXPECT_EQ(entries[0].json, std::string("{\0}", 3));
  EXPECT_EQ(entries[1].json, "{4}");
  EXPECT_EQ(entries[2].json, "{33}");
  EXPECT_EQ(ArmsOf(file_), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(EntriesOf(file_, Kind::kVerdict, "c").empty());
}

TEST_F(StoreTest, ARunThatFailed_DoesNotTakeThePlaceOfAVerdict) {
  Keep(file_, Kind::kVerdict, {{"a", "2026-03", "h1", "{1}"}});
  Keep(file_, Kind::kVerdict, {{"a", "2026-03", "h1", "{0}", true}, {"a", "2026-04", "h2", "{0}", true}});
  ASSERT_EQ(EntriesOf(file_, Kind::kVerdict, "a").size(), 2U);
  EXPECT_EQ(EntriesOf(file_, Kind::kVerdict, "a")[0].json, "{1}");
  Keep(file_, Kind::kVerdict, {{"a", "2026-04", "h2", "{2}"}});
  EXPECT_EQ(EntriesOf(file_, Kind::kVerdict, "a")[1].json, "{2}");
}

TEST_F(StoreTest, KindsAreApart_AndAnArmThatHasOneIsListed) {
  Keep(file_, Kind::kVerdict, {{"a", "2026-01", "h1", "{1}"}});
  EXPECT_TRUE(EntriesOf(file_, Kind::kTable, "a").empty());  // nobody wrote one
  Keep(file_, Kind::kTable, {{"a", "2026-02", "crc", "{2}"}, {"a", "2026-03", "crc", "{3}"}});
  Keep(file_, Kind::kHealth, {{"c", "2026-02", "crc", "{4}"}});
  Keep(file_, Kind::kTable, {{"a", "2026-03", "crc", "{33}"}});
  ASSERT_EQ(EntriesOf(file_, Kind::kTable, "a").size(), 2U);  // a table that came back is another entry
  EXPECT_EQ(EntriesOf(file_, Kind::kTable, "a")[1].json, "{33}");
  EXPECT_EQ(EntriesOf(file_, Kind::kVerdict, "a").size(), 1U);
  EXPECT_EQ(EntriesOf(file_, Kind::kHealth, "c").size(), 1U);
  EXPECT_EQ(ArmsOf(file_), (std::vector<std::string>{"a", "c"}));
}

TEST_F(StoreTest, AnotherFile_IsRefusedInOneLine) {
  const auto text = folder_.Write("text.txt", std::string(5000, 'x'));
  for (const std::string& error :
       {ErrorOf([&] { Keep(text, Kind::kTable, {}); }), ErrorOf([&] { EntriesOf(text, Kind::kHealth, "a"); }),
        ErrorOf([&] { ArmsOf(folder_ / "none.sqlite"); })}) {
    EXPECT_NE(error, "");
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_EQ(files::test::ReadBytes(text), std::string(5000, 'x'));
}

}  // namespace
}  // namespace armcal::fleet
