// report - writes the data of live charts.
#include "host_sim/data/report/live.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "codegen/src/io/json.hpp"
#include "host_sim/data/report/assets.hpp"
#include "host_sim/data/report/thin.hpp"

namespace armcal::report {

namespace {

// A JSON string that cannot end the script element around it.
std::string Quoted(const std::string& text) {
  std::string safe;
  for (const char c : io::JsonText(text)) {
    if (c == '<') safe += "\\u003c";
    else safe += c;
  }
  return safe;
}

// One panel's rows to show: the extremes of every series and, if differences are offered, of these.
std::vector<std::size_t> Shown(const Plot& plot, bool differences, std::size_t most) {
  std::vector<const std::vector<double>*> columns;
  std::vector<std::vector<double>> difference;
  for (const Series& series : plot.series) columns.push_back(&series.y);
  for (std::size_t s = 1; differences && s < plot.series.size(); ++s) {
    difference.push_back(plot.series[0].y);
    for (std::size_t k = 0; k < difference.back().size(); ++k) difference.back()[k] -= plot.series[s].y[k];
  }
  for (const auto& column : difference) columns.push_back(&column);
  return KeepExtremes(columns, most / std::max<std::size_t>(2 * columns.size(), 1));
}

std::string Rows(const Plot& plot, const std::vector<std::size_t>& shown) {
  std::string rows;
  const auto add = [&rows](double value, int digits) {
    if (std::isfinite(value)) fmt::format_to(std::back_inserter(rows), "{:.{}g}", value, digits);
    else rows += "null";
  };
  for (const std::size_t k : shown) {
    rows += rows.empty() ? "[" : ",[";
    add(plot.series[0].x[k], 7);
    for (const Series& series : plot.series) rows += ',', add(series.y[k], 5);
    rows += ']';
  }
  return rows;
}

std::string Data(const Panel& panel, bool differences, std::size_t most) {
  const Plot& plot = panel.plot;
  std::string series, shades;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    if (plot.series[s].x != plot.series[0].x || plot.series[s].y.size() != plot.series[s].x.size())
      throw std::invalid_argument("live chart '" + panel.name + "': its series differ in x");
    series += fmt::format("{}{{\"name\":{},\"colour\":{},\"dashed\":{}}}", s == 0 ? "" : ",",
                          Quoted(plot.series[s].name), Colour(plot, s), plot.series[s].style == Style::kDashes);
  }
  for (const Shade& shade : plot.shades)
    shades += fmt::format("{}{{\"from\":{},\"text\":{}}}", shades.empty() ? "" : ",", shade.from, Quoted(shade.text));
  return fmt::format(
      "{{\"name\":{},\"title\":{},\"x\":{},\"y\":{},\"shown\":{},\"logx\":{},\"logy\":{},\"series\":[{}],"
      "\"shades\":[{}],\"rows\":[{}]}}",
      Quoted(panel.name), Quoted(plot.text.title), Quoted(plot.text.x_label), Quoted(plot.text.y_label), panel.shown,
      plot.logarithmic_x, plot.logarithmic_y, series, shades,
      plot.series.empty() ? "" : Rows(plot, Shown(plot, differences, most)));
}

}  // namespace

std::string Html(const Live& live) {
  std::string html = "<div class='still grid2'>", data;
  const std::size_t most = kLiveRows / std::max<std::size_t>(live.panels.size(), 1);
  for (const Panel& panel : live.panels) {
    html += Svg(panel.plot);
    data += (data.empty() ? "" : ",\n") + Data(panel, !live.difference.empty(), most);
  }
  html += "</div>";
  if (assets::kDygraphs.empty()) return html;
  return html + "<script type='application/json' class='charts'>{\"difference\":" + Quoted(live.difference) +
         ",\"panels\":[" + data + "]}</script>";
}

std::string LiveScripts() {
  if (assets::kDygraphs.empty()) return "";
  return fmt::format("<script>/*\n{}\n*/\n{}</script>\n<script>{}</script>\n", assets::kDygraphsLicence,
                     assets::kDygraphs, assets::kLiveScript);
}

}  // namespace armcal::report
