// report - draws the frame of every picture as SVG: axes, grid, labels and legend.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host_sim/data/report/axis.hpp"

namespace armcal::report {

// Text made safe for HTML and SVG.
std::string Escape(std::string_view text);

// What the frame says. Sizes are those of the drawing; on the page it changes with its column.
struct FrameText {
  std::string title{}, x_label{}, y_label{};
  int width_px = 460, height_px = 250;
};

// An entry without a name is not drawn.
struct LegendEntry {
  std::string name;
  int colour = 0;
  bool dashed = false;
};

class Canvas {
 public:
  Canvas(const FrameText& text, const std::vector<LegendEntry>& legend);

  // Grid, ticks and axis labels; call before drawing so that the data lie on top.
  void DrawXAxis(const Axis& axis);
  void DrawYAxis(const Axis& axis);
  // Names below the plot area, one in the middle of each of names.size() equal slots.
  void DrawCategories(const std::vector<std::string>& names);
  // Greys what lies right of this share of the plot area; before the axes, so that the grid lies on top.
  void DrawShade(double from, const std::string& text);

  // Pixels of a place in the plot area; (0, 0) is bottom left, (1, 1) top right.
  double X(double share) const { return left_ + share * (right_ - left_); }
  double Y(double share) const { return bottom_ - share * (bottom_ - top_); }

  void Add(std::string_view svg) { body_ += svg; }
  std::string Svg() const;

 private:
  void DrawLegend(const std::vector<LegendEntry>& legend);

  FrameText text_;
  double left_, right_, top_, bottom_;
  std::string body_;
};

inline constexpr int kColours = 7;  // defined once for light and once for dark in the page's style sheet

}  // namespace armcal::report
