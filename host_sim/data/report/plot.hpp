// report - draws lines and points over a numeric axis, and bars over names, as inline SVG.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/report/canvas.hpp"

namespace armcal::report {

enum class Style { kLine, kPoints, kSteps };

// y over x, same length. NaN breaks a line. A long line is thinned to its lowest and highest sample per stretch, so
// that no peak is lost; points are thinned evenly. At most kMostPoints are drawn.
struct Series {
  std::string name{};  // legend entry, with unit if it differs from the axis; empty: none
  std::vector<double> x{}, y{};
  Style style = Style::kLine;
};

struct Plot {
  FrameText text{};  // labels carry the unit: "time / s"
  std::vector<Series> series{};
  bool logarithmic_x = false, logarithmic_y = false;
};

// One group of bars per category, one colour per series: value[series][category], NaN where there is none.
struct Bars {
  FrameText text{};
  std::vector<std::string> categories;
  std::vector<std::string> series;
  std::vector<std::vector<double>> value;
};

inline constexpr std::size_t kMostPoints = 2000;

// Complete <svg> elements; their colours come from the page's style sheet. std::invalid_argument: lengths that differ.
std::string Svg(const Plot& plot);
std::string Svg(const Bars& bars);

}  // namespace armcal::report
