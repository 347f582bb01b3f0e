// verdict - counts verdicts by kind and joint.
#include "host_sim/diagnose/verdict/summary.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host_sim/data/report/page.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"
#include "host_sim/diagnose/verdict/type_prior.hpp"

namespace armcal::verdict {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

// Confirmed terms as "kind joint".
std::string Terms(const ordered_json& verdict) {
  std::string text;
  for (const auto& t : verdict.at("terms"))
    text += (text.empty() ? "" : "; ") + t.at("kind").get<std::string>() + " " + JointText(t.at("joint"));
  return text;
}

report::Table FindingTable(const ordered_json& summary) {
  report::Table t{{"finding", "joint", "logs", "share %", "first in"}, {}};
  for (const auto& f : summary.at("findings"))
    t.rows.push_back({f.at("kind"), JointText(f.at("joint")), std::to_string(f.at("logs").size()),
                      fmt::format("{:.0f}", 100.0 * static_cast<double>(f.at("logs").size()) /
                                                static_cast<double>(summary.at("verdicts").size())),
                      f.at("logs").at(0)});
  return t;
}

// The largest share of a joint's error that the terms removed.
std::string Gain(const ordered_json& verdict) {
  double best = 0;
  for (std::size_t j = 0; j < verdict.at("before_moving").size(); ++j) {
    const double before = NumberOf(verdict.at("before_moving").at(j)),
                 after = NumberOf(verdict.at("after_moving").at(j));
    if (before > 0) best = std::max(best, 1 - after / before);
  }
  return fmt::format("{:.1f}", 100 * best);
}

report::Table VerdictTable(const ordered_json& summary) {
  report::Table t{{"log", "verdict", "error removed %", "terms, or what is wrong"}, {}};
  for (const auto& v : summary.at("verdicts")) {
    const bool failed = Failed(v), effect = v.at("verdict") == "effect";
    t.rows.push_back(
        {v.at("name"), v.at("verdict"), effect ? Gain(v) : "-", failed ? v.at("error").get<std::string>() : Terms(v)});
  }
  return t;
}

// Of every log what is farthest from its type.
report::Table FarTable(const ordered_json& summary) {
  report::Table t{{"log", "parameter", "value", "its type", "deviations", "others"}, {}};
  std::multimap<double, const ordered_json*, std::greater<>> verdicts;  // by the deviations of the farthest
  for (const auto& v : summary.at("verdicts"))
    if (v.contains("far_from_type") && !v.at("far_from_type").empty())
      if (const double far = NumberOf(v.at("far_from_type").at(0).at("deviations")); std::isfinite(far))
        verdicts.emplace(far, &v);
  for (const auto& [deviations, verdict] : verdicts) {
    const ordered_json& far = verdict->at("far_from_type");
    const ordered_json& most = far.at(0);
    const auto number = [&most](const char* key) { return NumberOf(most.at(key)); };
    t.rows.push_back({verdict->at("name"), most.at("parameter"),
                      fmt::format("{:.4g} {}", number("value"), most.at("unit").get<std::string>()),
                      fmt::format("{:.4g} +- {:.2g}", number("median"), number("spread")),
                      fmt::format("{:.1f}", deviations), std::to_string(far.size() - 1)});
  }
  return t;
}

std::string Headline(const ordered_json& s) {
  return fmt::format("{} logs: {} with an effect, {} without, {} failed", s.at("verdicts").size(),
                     s.at("effect").get<int>(), s.at("none").get<int>(), s.at("failed").get<int>());
}

}  // namespace

ordered_json SummaryJson(const Verdicts& verdicts) {
  ordered_json s{{"effect", 0}, {"none", 0}, {"failed", 0}, {"findings", ordered_json::array()}};
  s["types"] = TypesJson(verdicts);
  s["verdicts"] = ordered_json::array();
  std::map<std::pair<std::string, std::string>, ordered_json> findings;  // by kind and joint
  for (const auto& [name, v] : verdicts) {
    const std::string verdict = v.at("verdict");
    s[verdict] = s[verdict].get<int>() + 1;
    ordered_json row{{"name", name}, {"verdict", verdict}};
    if (Failed(v)) {
      row["error"] = v.at("error");
      s["verdicts"].push_back(row);
      continue;
    }
    row["terms"] = ordered_json::array();
    for (const auto& t : v.at("terms")) {
      if (!t.value("confirmed", true)) continue;
      row["terms"].push_back({{"kind", t.at("kind")}, {"joint", t.at("joint")}, {"parameters", t.at("parameters")}});
      ordered_json& f = findings[{t.at("kind").get<std::string>(), JointText(t.at("joint"))}];
      if (f.is_null()) f = {{"kind", t.at("kind")}, {"joint", t.at("joint")}, {"logs", ordered_json::array()}};
      f["logs"].push_back(name);
    }
    row["far_from_type"] = FarFromType(s["types"], v);
    row["before_moving"] = v.at("before_moving"), row["after_moving"] = v.at("after_moving");
    s["verdicts"].push_back(row);
  }
  std::vector<ordered_json> sorted;
  for (auto& [key, f] : findings) sorted.push_back(std::move(f));
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a["logs"].size() > b["logs"].size(); });
  for (auto& f : sorted) s["findings"].push_back(std::move(f));
  return s;
}

std::string SummaryText(const ordered_json& s) {
  std::string text = report::Text(VerdictTable(s));
  if (!s.at("findings").empty()) text += "\n" + report::Text(FindingTable(s));
  if (const report::Table far = FarTable(s); !far.rows.empty())
    text += "\nfar from the other arms of their type:\n" + report::Text(far);
  return text + Headline(s) + "\n";
}

void WriteSummaryPage(const fs::path& path, const ordered_json& s, const fs::path& pages) {
  report::Page page("What the models of many arms lack", "One verdict a log; terms that held on its held-out log.");
  page.Box(s.at("failed") > 0 ? report::Tone::kWarning : report::Tone::kNeutral, Headline(s));
  if (!s.at("findings").empty()) {
    page.Section("What was found");
    page.Add(FindingTable(s));
  }
  if (report::Table far = FarTable(s); !far.rows.empty()) {
    page.Section("Far from their type");
    far.caption =
        "Declared parameters more than five deviations from the median of all logs of the same robot. Its type: median "
        "and "
        "spread of these logs. Others: how many more parameters of this log are so far.";
    page.Add(far);
  }
  page.Section("Log by log");
  report::Table logs = VerdictTable(s);
  logs.caption = "Error removed: RMS on the held-out log where the joint moves, of the joint that gained most.";
  const fs::path folder = pages.empty() ? path.parent_path() : pages;
  for (const auto& row : logs.rows) {
    const fs::path own = folder / (row[0] + ".html");
    logs.link.push_back(fs::exists(own) ? fs::proximate(own, fs::absolute(path).parent_path()).generic_string() : "");
  }
  page.Add(logs);
  page.Write(path);
}

}  // namespace armcal::verdict
