// report - draws lines and points over a numeric axis, and bars over names, as inline SVG.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/report/canvas.hpp"

namespace armcal::report {

enum class Style { kLine, kDashes, kPoints };

// y over x, same length. NaN breaks a line. A long line is thinned to its lowest and highest sample per stretch, so
// that no peak is lost; points are thinned evenly.
struct Series {
  std::string name{};  // legend entry, with unit if it differs from the axis; empty: none
  std::vector<double> x{}, y{};
  Style style = Style::kLine;
  int colour = -1;  // below kColours; -1: its place among the series
};

// The plot area right of `from` is greyed; `text` stands there and says what it is.
struct Shade {
  double from = 0;
  std::string text{};
};

struct Plot {
  FrameText text{};  // labels carry the unit: "time / s"
  std::vector<Series> series{};
  bool logarithmic_x = false, logarithmic_y = false;
  std::vector<Shade> shades{};
};

// The colour of series s.
int Colour(const Plot& plot, std::size_t s);

// One group of bars per category, one colour per series: value[series][category], NaN where there is none.
struct Bars {
  FrameText text{};
  std::vector<std::string> categories;
  std::vector<std::string> series;
  std::vector<std::vector<double>> value;
  std::vector<int> colours{};  // of the series; empty: their places
};

inline constexpr std::size_t kMostPoints = 900;  // of a series in a picture, about two a pixel; gaps come on top

// Complete <svg> elements; their colours come from the page's style sheet. std::invalid_argument: lengths that differ.
std::string Svg(const Plot& plot);
std::string Svg(const Bars& bars);

}  // namespace armcal::report
