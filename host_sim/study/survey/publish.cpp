// survey - writes cells as text, JSON and HTML.
#include "host_sim/study/survey/publish.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "codegen/src/io/json.hpp"
#include "host_sim/data/report/axis.hpp"
#include "host_sim/data/report/page.hpp"

namespace armcal::survey {

using Object = nlohmann::ordered_json;

namespace {

Object JsonOf(double value) { return std::isfinite(value) ? Object(value) : Object(nullptr); }

Object JsonOf(const Cell& cell) {
  if (!cell.words.empty()) return cell.words;
  if (std::isnan(cell.low)) return JsonOf(cell.value);
  return {{"mean", JsonOf(cell.value)}, {"low", JsonOf(cell.low)}, {"high", JsonOf(cell.high)}};
}

report::Table GoalTable(const Findings& findings) {
  report::Table table{{"goal", "value", "wanted", "met"}, {}, {}};
  for (const Goal& g : findings.goals)
    table.rows.push_back({g.name, report::Number(g.value, 4),
                          fmt::format("{} {}", g.at_most ? "at most" : "at least", report::Number(g.goal)),
                          g.met() ? "yes" : "no"});
  return table;
}

std::string Figure(const Picture& p) {
  return "<h3>" + report::Escape("Figure " + p.number + ": " + p.title) + "</h3><figure>" + p.drawing + "<figcaption>" +
         report::Escape(p.caption) + "</figcaption></figure>\n";
}

}  // namespace

std::string TextOf(const Cell& cell) {
  if (!cell.words.empty()) return cell.words;
  if (std::isnan(cell.low) && cell.value == std::round(cell.value) && std::abs(cell.value) < 1e6)
    return fmt::format("{:.0f}", cell.value);
  if (std::isnan(cell.low)) return report::Number(cell.value, 4);
  const double up = cell.high - cell.value, down = cell.value - cell.low;
  if (std::abs(up - down) < 1e-6 * (up + down) || up + down == 0)
    return fmt::format("{} ± {}", report::Number(cell.value), report::Number(up, 2));
  return fmt::format("{} [{}, {}]", report::Number(cell.value), report::Number(cell.low), report::Number(cell.high));
}

report::Table TableOf(const Sheet& sheet) {
  report::Table table{sheet.columns, {}, sheet.title};
  for (const auto& row : sheet.rows) {
    table.rows.emplace_back();
    for (const Cell& cell : row) table.rows.back().push_back(TextOf(cell));
  }
  return table;
}

std::string Json(const Findings& findings, const Settings& settings) {
  Object tables = Object::object(), goals = Object::array();
  for (const Sheet& sheet : findings.sheets) {
    Object rows = Object::array();
    for (const auto& row : sheet.rows) {
      Object one = Object::object();
      for (std::size_t c = 0; c < row.size() && c < sheet.columns.size(); ++c) one[sheet.columns[c]] = JsonOf(row[c]);
      rows.push_back(one);
    }
    tables[sheet.number] = {{"title", sheet.title}, {"columns", sheet.columns}, {"rows", rows}, {"notes", sheet.notes}};
  }
  for (const Goal& g : findings.goals)
    goals.push_back(
        {{"name", g.name}, {"value", JsonOf(g.value)}, {"goal", g.goal}, {"at_most", g.at_most}, {"met", g.met()}});
  const Object all{{"robot", settings.robot.name},
                   {"seed", settings.seed},
                   {"draws", settings.draws},
                   {"tables", tables},
                   {"goals", goals}};
  return io::JsonText(all, 1) + "\n";
}

std::string Html(const Findings& findings, const Settings& settings) {
  report::Page page("The survey's tables and figures",
                    "Multi-joint robot dynamic calibration, section 6, on " + settings.robot.title +
                        "; the survey's printed figures beside ours, and better methods in the same tables.");
  page.Facts({{"robot file", settings.robot.name},
              {"seed", std::to_string(settings.seed)},
              {"draws", std::to_string(settings.draws) + ", of slow methods " + std::to_string(settings.slow_draws)},
              {"± and brackets", "95 % interval, of the mean over draws where there are draws"}});
  page.Section("Goals");
  page.Add(GoalTable(findings));
  page.Section("Tables");
  for (const Sheet& sheet : findings.sheets) {
    page.Subsection("Table " + sheet.number);
    page.Add(TableOf(sheet));
    if (!sheet.notes.empty()) page.List(sheet.notes);
  }
  page.Section("Figures");
  std::string drawings;
  for (const Picture& p : findings.pictures) {
    if (!p.drawing.empty()) {
      drawings += Figure(p);
      continue;
    }
    page.Subsection("Figure " + p.number + ": " + p.title);
    page.AddGrid(p.plots, p.caption);
  }
  // The page takes plots only, so the drawings are inserted at its end.
  std::string html = page.Html();
  return html.insert(html.rfind("</main>"), drawings);
}

std::string GoalLines(const Findings& findings) {
  std::string missed;
  int met = 0;
  for (const Goal& g : findings.goals) {
    met += g.met();
    if (!g.met())
      missed += fmt::format("  not met: {}: {}, wanted {} {}\n", g.name, report::Number(g.value, 4),
                            g.at_most ? "at most" : "at least", report::Number(g.goal));
  }
  return fmt::format("goals met: {} of {}\n", met, findings.goals.size()) + missed;
}

}  // namespace armcal::survey
