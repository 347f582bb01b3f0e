// fleet - reads the verdicts' numbers into courses and looks for steps in them.
#include "host_sim/diagnose/fleet/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/data/report/page.hpp"

namespace armcal::fleet {
namespace {

using nlohmann::ordered_json;

constexpr double kDeviations = 4, kShare = 0.1, kErrorShare = 0.25;
const char* const kErrorName = "error of joint ";

bool IsError(const std::string& name) { return name.starts_with(kErrorName); }

class Courses {
 public:
  void Add(const std::string& name, const std::string& unit, Point point) {
    const auto [at, is_new] = number_.try_emplace(name, course_.size());
    if (is_new) course_.push_back({name, unit, {}});
    if (std::isfinite(point.value)) course_[at->second].point.push_back(point);
  }
  std::vector<Course> course_;

 private:
  std::map<std::string, std::size_t> number_;
};

double NumberOf(const ordered_json& j) { return j.is_number() ? j.get<double>() : NAN; }

std::string TermsOf(const ordered_json& verdict) {
  std::vector<std::string> names;
  for (const ordered_json& term : verdict.at("terms"))
    if (term.at("confirmed").get<bool>())
      names.push_back(fmt::format("{} {}", term.at("record").get<std::string>(),
                                  fmt::join(term.at("joints").get<std::vector<int>>(), "-")));
  std::sort(names.begin(), names.end());
  return fmt::format("{}", fmt::join(names, "; "));
}

void AddNumbers(const ordered_json& verdict, std::size_t log, Courses& courses) {
  for (const ordered_json& p : verdict.at("declared_parameters"))
    courses.Add(p.at("name"), p.at("unit"), {log, NumberOf(p.at("value")), NumberOf(p.at("sd"))});
  const ordered_json& load = verdict.at("payload");
  courses.Add("payload", "kg",
              {log, load.is_object() ? NumberOf(load.at("mass_kg")) : 0,
               load.is_object() ? NumberOf(load.at("mass_sd_kg")) : 0});
  const ordered_json& errors = verdict.at("after_moving");
  const auto list = [&](const char* key) { return verdict.value(key, ordered_json::array()); };
  const ordered_json moves = list("moving_share"), units = list("torque_units");
  for (std::size_t j = 0; j < errors.size(); ++j)
    if (j >= moves.size() || NumberOf(moves[j]) > 0)  // a joint that rests has no error
      courses.Add(kErrorName + std::to_string(j + 1), j < units.size() ? units[j].get<std::string>() : "N m",
                  {log, NumberOf(errors[j]), 0});
}

void FindChanges(const Course& course, std::vector<Change>& changes) {
  std::vector<Point> steady;  // since the last change
  for (const Point& p : course.point) {
    double mean = 0, variance = 0, scatter = 0;
    const auto count = static_cast<double>(steady.size());
    for (const Point& s : steady) mean += s.value / count, variance += s.sd * s.sd / count;
    for (const Point& s : steady) scatter += (s.value - mean) * (s.value - mean) / std::max(1.0, count - 1);
    const double share = IsError(course.name) ? kErrorShare : kShare;
    const double allowed = std::max(kDeviations * std::sqrt(p.sd * p.sd + variance + scatter), share * std::abs(mean));
    if (!steady.empty() && std::abs(p.value - mean) > allowed) {
      changes.push_back({p.log, course.name, course.unit, mean, p.value});
      steady.clear();
    }
    steady.push_back(p);
  }
}

[[noreturn]] void RefuseEntry(const Entry& e, const std::string& expected) {
  throw io::InputError(e.arm + ", " + e.date + ": expected " + expected);
}

Event EventOf(const Entry& e, Kind kind) {
  try {
    const ordered_json json = io::ParseJson(e.json);
    if (kind == Kind::kTable)
      return {e.date, fmt::format("table {} by armcal {}", e.hash, json.at("by").get<std::string>()), json};
    std::vector<std::string> joints;
    for (const ordered_json& j : json.at("joints"))
      if (const auto verdict = j.at("verdict").get<std::string>();
          verdict == "no_longer_fits" || verdict == "never_fitted")
        joints.push_back(std::to_string(j.at("joint").get<int>()));
    const auto verdict = json.at("verdict").get<std::string>();
    const std::string what = verdict == "fits"     ? "all joints fit"
                             : verdict == "misfit" ? fmt::format("joints that do not fit: {}", fmt::join(joints, ", "))
                                                   : "too early to tell";
    return {e.date, fmt::format("health under table {}: {}", e.hash, what), json};
  } catch (const nlohmann::ordered_json::exception&) {
    RefuseEntry(e, kind == Kind::kTable ? "a table of this version" : "a health reading of this version");
  }
}

std::string OrNothing(const std::string& terms) { return terms.empty() ? "nothing" : terms; }

std::string Words(const History& history, const Change& c) {
  const std::string when = history.entry[c.log].date + ": ";
  if (std::isnan(c.before)) return when + c.name;
  return when + fmt::format("{} from {:.4g} to {:.4g} {}", c.name, c.before, c.after, c.unit);
}

void AddLogs(report::Page& page, const History& history) {
  std::vector<std::string> lines;
  for (const Change& c : history.change) lines.push_back(Words(history, c));
  if (lines.empty()) page.Box(report::Tone::kGood, "Nothing changed");
  else page.Box(report::Tone::kWarning, "What changed", lines);
  page.Section("Course of each quantity");
  std::vector<report::Plot> plots;
  for (const Course& c : history.course) {
    report::Series series;
    for (const Point& p : c.point) series.x.push_back(static_cast<double>(p.log) + 1), series.y.push_back(p.value);
    report::Plot plot{{c.name, "log", c.unit.empty() ? c.name : c.unit, 320}, {}};
    plot.series = {series};
    plots.push_back(plot);
  }
  page.AddGrid(plots, "Each point is one log, in the order of their dates.");
  report::Table t{{"log", "date", "found"}, {}};
  for (std::size_t log = 0; log < history.entry.size(); ++log)
    t.rows.push_back({std::to_string(log + 1), history.entry[log].date, OrNothing(history.terms[log])});
  page.Section("Logs");
  page.Add(t);
}

}  // namespace

History HistoryOf(const std::vector<Entry>& verdicts, const std::vector<Entry>& tables,
                  const std::vector<Entry>& readings) {
  History history;
  Courses courses;
  for (const Entry& e : verdicts) {
    try {
      const ordered_json verdict = io::ParseJson(e.json);
      if (verdict.at("verdict") == "failed") {
        ++history.failed;
        continue;
      }
      const std::size_t log = history.entry.size();
      history.terms.push_back(TermsOf(verdict));
      history.entry.push_back(e);
      AddNumbers(verdict, log, courses);
      if (log > 0 && history.terms[log] != history.terms[log - 1])
        history.change.push_back(
            {log, "found: " + OrNothing(history.terms[log]) + "; before: " + OrNothing(history.terms[log - 1]), "", NAN,
             NAN});
    } catch (const nlohmann::ordered_json::exception&) {
      RefuseEntry(e, "a verdict of this version: diagnose anew");
    }
  }
  history.course = std::move(courses.course_);
  for (const Course& course : history.course) FindChanges(course, history.change);
  std::stable_sort(history.change.begin(), history.change.end(),
                   [](const Change& a, const Change& b) { return a.log < b.log; });
  for (const Entry& e : tables) history.event.push_back(EventOf(e, Kind::kTable));
  for (const Entry& e : readings) history.event.push_back(EventOf(e, Kind::kHealth));
  std::stable_sort(history.event.begin(), history.event.end(),
                   [](const Event& a, const Event& b) { return a.date < b.date; });
  return history;
}

std::string HistoryText(const History& history) {
  report::Table t{{"date", "payload kg", "found"}, {}};
  std::vector<double> payload_kg(history.entry.size(), 0);
  for (const Course& c : history.course)
    if (c.name == "payload")
      for (const Point& p : c.point) payload_kg[p.log] = p.value;
  for (std::size_t log = 0; log < history.entry.size(); ++log)
    t.rows.push_back({history.entry[log].date, payload_kg[log] == 0 ? "-" : fmt::format("{:.3g}", payload_kg[log]),
                      OrNothing(history.terms[log])});
  std::string text;
  if (!history.entry.empty()) text = report::Text(t) + (history.change.empty() ? "nothing changed\n" : "changed:\n");
  for (const Change& c : history.change) text += "  " + Words(history, c) + "\n";
  if (history.failed > 0) text += fmt::format("without a verdict: {} logs\n", history.failed);
  if (!history.event.empty()) text += "the drive:\n";
  for (const Event& e : history.event) text += "  " + e.date + ": " + e.what + "\n";
  return text;
}

ordered_json HistoryJson(const History& history) {
  ordered_json json{{"logs", ordered_json::array()},
                    {"failed", history.failed},
                    {"courses", ordered_json::array()},
                    {"changes", ordered_json::array()},
                    {"drive", ordered_json::array()}};
  for (std::size_t log = 0; log < history.entry.size(); ++log)
    json["logs"].push_back(
        {{"date", history.entry[log].date}, {"log", history.entry[log].hash}, {"found", history.terms[log]}});
  for (const Course& c : history.course) {
    ordered_json& course = json["courses"].emplace_back(ordered_json{{"name", c.name}, {"unit", c.unit}});
    for (const Point& p : c.point) course["points"].push_back({{"log", p.log}, {"value", p.value}, {"sd", p.sd}});
  }
  for (const Change& c : history.change) {
    ordered_json& change = json["changes"].emplace_back(
        ordered_json{{"log", c.log}, {"date", history.entry[c.log].date}, {"what", c.name}});
    if (!std::isnan(c.before)) change["unit"] = c.unit, change["before"] = c.before, change["after"] = c.after;
  }
  for (const Event& e : history.event) {
    ordered_json& event = json["drive"].emplace_back(ordered_json{{"date", e.date}, {"what", e.what}});
    event.update(e.json);
  }
  return json;
}

void WriteHistoryPage(const std::filesystem::path& path, const std::string& arm, const History& history) {
  const bool logs = !history.entry.empty();
  report::Page page("History of " + arm, logs ? fmt::format("{} logs, {} to {}.", history.entry.size(),
                                                            history.entry.front().date, history.entry.back().date)
                                              : "No log.");
  if (logs) AddLogs(page, history);
  report::Table events{{"date", "what"}, {}};
  for (const Event& e : history.event) events.rows.push_back({e.date, e.what});
  if (!events.rows.empty()) {
    page.Section("Tables and health of the drive");
    page.Add(events);
  }
  page.Write(path);
}

}  // namespace armcal::fleet
