// report - draws grouped bars; knows no robot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host_sim/data/report/plot.hpp"

namespace armcal::report {

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
