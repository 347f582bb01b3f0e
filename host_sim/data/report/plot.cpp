// report - draws series of samples and groups of bars.
#include "host_sim/data/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "host_sim/data/report/thin.hpp"

namespace armcal::report {

namespace {

constexpr double kNumberWidth_px = 20;  // a narrower bar has no room for its number

// Indices of the samples to draw.
std::vector<std::size_t> Drawn(const Series& series) {
  if (series.style != Style::kPoints) return KeepExtremes({&series.y}, kMostPoints / 2);
  std::vector<std::size_t> keep;
  const std::size_t stride = std::max<std::size_t>(1, (series.x.size() + kMostPoints - 1) / kMostPoints);
  for (std::size_t k = 0; k < series.x.size(); k += stride) keep.push_back(k);
  return keep;
}

std::string Draw(const Series& series, int colour, const Axis& x, const Axis& y, const Canvas& canvas) {
  std::string path;
  bool pen_down = false;
  for (const std::size_t k : Drawn(series)) {
    const double px = canvas.X(x.Place(series.x[k])), py = canvas.Y(y.Place(series.y[k]));
    if (!std::isfinite(px) || !std::isfinite(py)) {
      pen_down = false;
      continue;
    }
    if (series.style == Style::kPoints) {
      fmt::format_to(std::back_inserter(path), "M{:.1f} {:.1f}h0", px, py);  // a round cap makes a dot of it
    } else {
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', px, py);
    }
    pen_down = true;
  }
  const char* kind = series.style == Style::kPoints ? "dots" : series.style == Style::kDashes ? "line dash" : "line";
  return fmt::format("<path class='{} s{}' d='{}'/>", kind, colour, path);
}

}  // namespace

int Colour(const Plot& plot, std::size_t s) {
  return plot.series[s].colour >= 0 ? plot.series[s].colour : static_cast<int>(s % kColours);
}

std::string Svg(const Plot& plot) {
  std::vector<double> all_x, all_y;
  std::vector<LegendEntry> legend;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const Series& series = plot.series[s];
    if (series.x.size() != series.y.size()) throw std::invalid_argument("series '" + series.name + "': x and y differ");
    all_x.insert(all_x.end(), series.x.begin(), series.x.end());
    all_y.insert(all_y.end(), series.y.begin(), series.y.end());
    legend.push_back({series.name, Colour(plot, s), series.style == Style::kDashes});
  }
  const Axis x(all_x, plot.logarithmic_x, false), y(all_y, plot.logarithmic_y, false);
  Canvas canvas(plot.text, legend);
  for (const Shade& shade : plot.shades) canvas.DrawShade(x.Place(shade.from), shade.text);
  canvas.DrawXAxis(x);
  canvas.DrawYAxis(y);
  for (std::size_t s = 0; s < plot.series.size(); ++s) canvas.Add(Draw(plot.series[s], Colour(plot, s), x, y, canvas));
  return canvas.Svg();
}

std::string Svg(const Bars& bars) {
  std::vector<double> all;
  if (bars.value.size() != bars.series.size()) throw std::invalid_argument("bars: one list of values per series");
  for (const auto& values : bars.value) {
    if (values.size() != bars.categories.size()) throw std::invalid_argument("bars: one value per category");
    all.insert(all.end(), values.begin(), values.end());
  }
  std::vector<LegendEntry> legend;
  for (std::size_t s = 0; s < bars.series.size(); ++s)
    legend.push_back({bars.series[s], s < bars.colours.size() ? bars.colours[s] : static_cast<int>(s % kColours)});
  const Axis y(all, false, true);
  Canvas canvas(bars.text, legend);
  canvas.DrawYAxis(y);
  canvas.DrawCategories(bars.categories);
  const double slot = 1.0 / static_cast<double>(std::max<std::size_t>(bars.categories.size(), 1));
  const double width = 0.76 * slot / static_cast<double>(std::max<std::size_t>(bars.series.size(), 1));
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    const int colour = legend[s].colour;
    for (std::size_t c = 0; c < bars.categories.size(); ++c) {
      const double value = bars.value[s][c];
      if (!std::isfinite(value)) continue;
      const double left = canvas.X((static_cast<double>(c) + 0.12) * slot + static_cast<double>(s) * width);
      const double right = canvas.X((static_cast<double>(c) + 0.12) * slot + static_cast<double>(s + 1) * width) - 1.5;
      const double top = canvas.Y(y.Place(std::max(value, 0.0))), bottom = canvas.Y(y.Place(std::min(value, 0.0)));
      canvas.Add(
          fmt::format("<rect class='f{}' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'><title>{} {}: {}"
                      "</title></rect>",
                      colour, left, top, right - left, std::max(bottom - top, 0.5), Escape(bars.categories[c]),
                      Escape(bars.series[s]), Number(value, 4)));
      if (right - left < kNumberWidth_px) continue;
      canvas.Add(fmt::format("<text class='number' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>",
                             (left + right) / 2, (value < 0 ? bottom + 12 : top - 4), Number(value, 2)));
    }
  }
  return canvas.Svg();
}

}  // namespace armcal::report
