// report - draws the frame of a picture.
#include "host_sim/data/report/canvas.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace armcal::report {

namespace {
constexpr double kLargest = 1.2;  // how far a picture grows with its column
}

std::string Escape(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&') safe += "&amp;";
    else if (c == '<') safe += "&lt;";
    else if (c == '>') safe += "&gt;";
    else if (c == '"') safe += "&quot;";
    else if (c == '\'') safe += "&#39;";
    else safe += c;
  }
  return safe;
}

Canvas::Canvas(const FrameText& text, const std::vector<LegendEntry>& legend)
    : text_(text),
      left_(text.y_label.empty() ? 52 : 68),
      right_(text.width_px - 20),
      top_(text.title.empty() ? 12 : 34),
      bottom_(text.height_px - (text.x_label.empty() ? 28 : 46)) {
  if (!text_.title.empty()) Add(fmt::format("<text class='title' x='{}' y='20'>{}</text>", left_, Escape(text_.title)));
  DrawLegend(legend);
}

// Right of the title if both fit into that line, else in a line of its own above the data.
void Canvas::DrawLegend(const std::vector<LegendEntry>& legend) {
  constexpr double kLetter_px = 7, kSwatch_px = 30;  // about the mean width of a letter
  const auto width = [](const LegendEntry& e) {
    return e.name.empty() ? 0 : kSwatch_px + kLetter_px * static_cast<double>(e.name.size());
  };
  double all = 0;
  for (const LegendEntry& entry : legend) all += width(entry);
  if (all == 0) return;
  const bool beside = left_ + 8.2 * static_cast<double>(text_.title.size()) + all < right_;
  double x = beside ? right_ - all : std::max(8.0, std::min(left_, right_ - all)), y = 16;
  if (!beside) y = text_.title.empty() ? 10 : 36, top_ = y + 14;
  for (const LegendEntry& entry : legend) {
    if (entry.name.empty()) continue;
    Add(fmt::format(
        "<path class='swatch{} s{}' d='M{:.1f} {:.1f}h16'/><text class='tick' x='{:.1f}' y='{:.1f}'>{}</text>",
        entry.dashed ? " dash" : "", entry.colour, x, y, x + 20, y + 4, Escape(entry.name)));
    x += width(entry);
  }
}

void Canvas::DrawShade(double from, const std::string& text) {
  if (!(from < 1)) return;
  const double left = X(std::max(from, 0.0));
  Add(fmt::format(
      "<rect class='shade' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'/><text class='tick' x='{:.1f}' "
      "y='{:.1f}' text-anchor='end'>{}</text>",
      left, top_, right_ - left, bottom_ - top_, right_ - 4, top_ + 14, Escape(text)));
}

void Canvas::DrawXAxis(const Axis& axis) {
  for (const double tick : axis.ticks()) {
    const double x = X(axis.Place(tick));
    Add(
        fmt::format("<path class='grid' d='M{0:.1f} {1:.1f}V{2:.1f}'/><text class='tick' x='{0:.1f}' y='{3:.1f}' "
                    "text-anchor='middle'>{4}</text>",
                    x, top_, bottom_, bottom_ + 17, axis.Label(tick)));
  }
}

void Canvas::DrawYAxis(const Axis& axis) {
  for (const double tick : axis.ticks()) {
    const double y = Y(axis.Place(tick));
    Add(
        fmt::format("<path class='grid' d='M{0:.1f} {1:.1f}H{2:.1f}'/><text class='tick' x='{3:.1f}' y='{4:.1f}' "
                    "text-anchor='end'>{5}</text>",
                    left_, y, right_, left_ - 7, y + 4, axis.Label(tick)));
  }
  const double zero = axis.Place(0);
  if (zero > 0 && zero < 1) Add(fmt::format("<path class='zero' d='M{:.1f} {:.1f}H{:.1f}'/>", left_, Y(zero), right_));
}

void Canvas::DrawCategories(const std::vector<std::string>& names) {
  for (std::size_t k = 0; k < names.size(); ++k) {
    const double x = X((static_cast<double>(k) + 0.5) / static_cast<double>(names.size()));
    Add(fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>", x, bottom_ + 17,
                    Escape(names[k])));
  }
}

std::string Canvas::Svg() const {
  std::string svg = fmt::format("<svg viewBox='0 0 {0} {1}' style='max-width:{2:.0f}px' role='img' aria-label='{3}'>",
                                text_.width_px, text_.height_px, kLargest * text_.width_px, Escape(text_.title));
  svg += body_;
  svg += fmt::format("<path class='axis' d='M{:.1f} {:.1f}V{:.1f}H{:.1f}'/>", left_, top_, bottom_, right_);
  if (!text_.x_label.empty()) {
    svg += fmt::format("<text class='label' x='{:.1f}' y='{}' text-anchor='middle'>{}</text>", (left_ + right_) / 2,
                       text_.height_px - 8, Escape(text_.x_label));
  }
  if (!text_.y_label.empty()) {
    const double middle = (top_ + bottom_) / 2;
    svg += fmt::format(
        "<text class='label' x='14' y='{0:.1f}' text-anchor='middle' transform='rotate(-90 14 {0:.1f})'>{1}</text>",
        middle, Escape(text_.y_label));
  }
  return svg + "</svg>";
}

}  // namespace armcal::report
