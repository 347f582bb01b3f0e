// verdict tests - files that are not quite verdicts or summaries: every value is left out, and replaced by others.
#include <gtest/gtest.h>

#include <functional>

#include "host_sim/diagnose/verdict/summary.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::verdict {
namespace {

using nlohmann::ordered_json;

const ordered_json kVerdict{
    {"verdict", "effect"},
    {"terms",
     {{{"kind", "stribeck"}, {"joint", 2}, {"confirmed", true}, {"parameters", {{"vs2", 0.1}}}},
      {{"kind", "wrist_coupling"}, {"joint", "5-6"}, {"confirmed", false}, {"parameters", ordered_json::object()}}}},
    {"before_moving", {1.5, nullptr}},
    {"after_moving", {1.2, nullptr}}};

const std::vector<ordered_json> kOthers{
    nullptr, true, -1, 1e308, "text", ordered_json::array(), {1}, {{1}}, ordered_json::object(), {{"a", 1}}};

// Calls `use` with `json` in which one value is left out, or is another; `at`: where.
void ForEachChange(ordered_json& json, ordered_json& at, const std::function<void()>& use) {
  if (!at.is_structured()) return;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const auto place = [&] { return std::next(at.begin(), static_cast<std::ptrdiff_t>(k)); };
    ForEachChange(json, *place(), use);
    const ordered_json whole = at;
    for (const ordered_json& other : kOthers) {
      *place() = other;
      use();
    }
    at = whole;
    at.erase(place());
    use();
    at = whole;
  }
}

TEST(VerdictFile, OfAnyContent_IsAVerdictWithASummary_OrAFailedOne) {
  const files::test::TemporaryFolder folder;
  int good = 0, failed = 0;
  ordered_json changed = kVerdict;
  ForEachChange(changed, changed, [&] {
    const Verdicts read = ReadVerdicts({folder.Write("log.json", changed.dump())});
    const ordered_json summary = SummaryJson(read);
    EXPECT_FALSE(SummaryText(summary).empty());
    WriteSummaryPage(folder / "page.html", summary);
    ++(read.at("log").at("verdict") == "failed" ? failed : good);
  });
  EXPECT_GT(good, 20);  // for example another kind, or an error that is not finite
  EXPECT_GT(failed, 100);
}

TEST(VerdictFile, ASummaryThatLacksSomething_MakesNoPage_AndSaysSo) {
  const files::test::TemporaryFolder folder;
  const ordered_json whole = SummaryJson({{"a", kVerdict}, {"b", FailedVerdict("no rows")}});
  WriteSummaryPage(folder / "page.html", whole);
  int refused = 0;
  ordered_json changed = whole;
  ForEachChange(changed, changed, [&] {
    try {
      WriteSummaryPage(folder / "page.html", changed);
    } catch (const ordered_json::exception&) {
      ++refused;
    }
  });
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace armcal::verdict
