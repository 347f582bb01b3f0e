// report - draws series of samples and groups of bars.
#include "host_sim/data/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

namespace armcal::report {

namespace {

// Indices of the samples to draw.
std::vector<std::size_t> Thin(const Series& series) {
  const std::size_t n = series.x.size();
  std::vector<std::size_t> keep;
  if (n <= kMostPoints || series.style != Style::kLine) {
    const std::size_t stride = (n + kMostPoints - 1) / kMostPoints;
    for (std::size_t k = 0; k < n; k += std::max<std::size_t>(stride, 1)) keep.push_back(k);
    return keep;
  }
  const std::size_t stretches = kMostPoints / 2;
  for (std::size_t s = 0; s < stretches; ++s) {
    const auto first = series.y.begin() + static_cast<std::ptrdiff_t>(s * n / stretches);
    const auto last = series.y.begin() + static_cast<std::ptrdiff_t>((s + 1) * n / stretches);
    const auto gap = std::find_if(first, last, [](double v) { return !std::isfinite(v); });
    auto [low, high] = std::minmax_element(first, gap);
    if (gap == first) low = high = first;
    const auto a = static_cast<std::size_t>(std::min(low, high) - series.y.begin());
    const auto b = gap != last ? static_cast<std::size_t>(gap - series.y.begin())
                               : static_cast<std::size_t>(std::max(low, high) - series.y.begin());
    keep.push_back(a);
    if (b != a) keep.push_back(b);
  }
  return keep;
}

std::string Draw(const Series& series, std::size_t colour, const Axis& x, const Axis& y, const Canvas& canvas) {
  std::string path;
  bool pen_down = false;
  for (const std::size_t k : Thin(series)) {
    const double px = canvas.X(x.Place(series.x[k])), py = canvas.Y(y.Place(series.y[k]));
    if (!std::isfinite(px) || !std::isfinite(py)) {
      pen_down = false;
      continue;
    }
    if (series.style == Style::kPoints) {
      fmt::format_to(std::back_inserter(path), "M{:.1f} {:.1f}h0", px, py);  // a round cap makes a dot of it
    } else if (series.style == Style::kSteps && pen_down) {
      fmt::format_to(std::back_inserter(path), "H{:.1f}V{:.1f}", px, py);
    } else {
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', px, py);
    }
    pen_down = true;
  }
  return fmt::format("<path class='{} s{}' d='{}'/>", series.style == Style::kPoints ? "dots" : "line",
                     colour % kColours, path);
}

}  // namespace

std::string Svg(const Plot& plot) {
  std::vector<double> all_x, all_y;
  std::vector<std::string> names;
  for (const Series& series : plot.series) {
    if (series.x.size() != series.y.size()) throw std::invalid_argument("series '" + series.name + "': x and y differ");
    all_x.insert(all_x.end(), series.x.begin(), series.x.end());
    all_y.insert(all_y.end(), series.y.begin(), series.y.end());
    names.push_back(series.name);
  }
  const Axis x(all_x, plot.logarithmic_x, false), y(all_y, plot.logarithmic_y, false);
  Canvas canvas(plot.text);
  canvas.DrawXAxis(x);
  canvas.DrawYAxis(y);
  for (std::size_t k = 0; k < plot.series.size(); ++k) canvas.Add(Draw(plot.series[k], k, x, y, canvas));
  canvas.DrawLegend(names);
  return canvas.Svg();
}

std::string Svg(const Bars& bars) {
  std::vector<double> all;
  if (bars.value.size() != bars.series.size()) throw std::invalid_argument("bars: one list of values per series");
  for (const auto& values : bars.value) {
    if (values.size() != bars.categories.size()) throw std::invalid_argument("bars: one value per category");
    all.insert(all.end(), values.begin(), values.end());
  }
  const Axis y(all, false, true);
  Canvas canvas(bars.text);
  canvas.DrawYAxis(y);
  canvas.DrawCategories(bars.categories);
  const double slot = 1.0 / static_cast<double>(std::max<std::size_t>(bars.categories.size(), 1));
  const double width = 0.76 * slot / static_cast<double>(std::max<std::size_t>(bars.series.size(), 1));
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    for (std::size_t c = 0; c < bars.categories.size(); ++c) {
      const double value = bars.value[s][c];
      if (!std::isfinite(value)) continue;
      const double left = canvas.X((static_cast<double>(c) + 0.12) * slot + static_cast<double>(s) * width);
      const double right = canvas.X((static_cast<double>(c) + 0.12) * slot + static_cast<double>(s + 1) * width) - 1.5;
      const double top = canvas.Y(y.Place(std::max(value, 0.0))), bottom = canvas.Y(y.Place(std::min(value, 0.0)));
      canvas.Add(
          fmt::format("<rect class='f{}' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'><title>{} {}: {}"
                      "</title></rect>",
                      s % kColours, left, top, right - left, std::max(bottom - top, 0.5), Escape(bars.categories[c]),
                      Escape(bars.series[s]), Number(value, 4)));
    }
  }
  canvas.DrawLegend(bars.series);
  return canvas.Svg();
}

}  // namespace armcal::report
