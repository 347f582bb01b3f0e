// report tests - check that pictures keep every peak and draw nothing for what is not a number.
#include "host_sim/data/report/plot.hpp"
#include "host_sim/data/report/style.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace armcal::report {
namespace {

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

Plot Line(std::size_t samples) {
  Plot plot{{"t", "time / s", "torque / (N m)"}, {{"joint 1", {}, {}}}};
  for (std::size_t k = 0; k < samples; ++k) {
    plot.series[0].x.push_back(0.004 * static_cast<double>(k));
    plot.series[0].y.push_back(std::sin(0.01 * static_cast<double>(k)));
  }
  return plot;
}

// Highest point drawn, in pixels from the top.
double Top(const std::string& svg) {
  const auto begin = svg.find("<path class='line");
  double top = 1e9;
  for (auto at = svg.find('d', begin + 12); at < svg.find("'/>", begin); ++at) {
    if (svg[at] == ' ') top = std::min(top, std::stod(svg.substr(at + 1)));
  }
  return top;
}

// Two logs may give one parameter but for its last digit.
TEST(Axis, OfValuesThatDifferInTheirLastDigit_HasFewTicks) {
  for (const double value : {0.5, -3e9, 1e-12}) {
    const Axis axis({value, std::nextafter(value, 2 * value)}, false, false);
    EXPECT_GE(axis.ticks().size(), 2U);
    EXPECT_LE(axis.ticks().size(), 12U);
  }
}

TEST(Plot, LongLine_IsThinnedAndKeepsASingleSamplePeak) {
  Plot plot = Line(100000);
  plot.series[0].y[54321] = 10;
  const std::string svg = Svg(plot);
  const auto begin = svg.find("<path class='line");
  const std::string path = svg.substr(begin, svg.find("'/>", begin) - begin);
  EXPECT_LE(Count(path, "L"), kMostPoints);
  EXPECT_GT(Count(path, "L"), kMostPoints / 4);
  plot.series[0].x = {0, 1};
  plot.series[0].y = {-1, 10};
  EXPECT_NEAR(Top(svg), Top(Svg(plot)), 0.11);  // the same range, so the same place; 0.1 px is the grid of the drawing
}

TEST(Plot, NotANumber_BreaksTheLineAndIsNeverWritten) {
  Plot plot = Line(100);
  plot.series[0].y[50] = NAN;
  plot.series[0].y[51] = INFINITY;
  const std::string svg = Svg(plot);
  EXPECT_EQ(Count(svg.substr(svg.find("<path class='line")), "M"), 3u);  // two pieces and the axes
  EXPECT_EQ(svg.find("nan"), svg.npos);
  EXPECT_EQ(svg.find("inf"), svg.npos);
}

TEST(Plot, NothingToShow_StillGivesAFrame) {
  EXPECT_NE(Svg(Plot{}).find("</svg>"), std::string::npos);
  EXPECT_NE(Svg(Bars{}).find("</svg>"), std::string::npos);
  Plot constant{{}, {{"c", {1, 1}, {5, 5}}}};
  EXPECT_EQ(Svg(constant).find("nan"), std::string::npos);
}

TEST(Plot, LogarithmicAxis_LeavesOutWhatIsNotPositive) {
  Plot plot{{}, {{"", {1, 2, 3, 4}, {1e-3, 0, -5, 1e2}}}};
  plot.logarithmic_y = true;
  const std::string svg = Svg(plot);
  EXPECT_NE(svg.find(">0.001<"), svg.npos);
  EXPECT_NE(svg.find(">100<"), svg.npos);
  EXPECT_EQ(svg.find("nan"), svg.npos);
}

TEST(Plot, LengthsThatDiffer_AreRefused) {
  Plot plot{{}, {{"a", {1, 2}, {1}}}};
  EXPECT_THROW(Svg(plot), std::invalid_argument);
  Bars bars{{}, {"j1", "j2"}, {"before"}, {{1}}};
  EXPECT_THROW(Svg(bars), std::invalid_argument);
}

TEST(Bars, OnePerValue_NanLeftOut) {
  const Bars bars{{}, {"j1", "j2"}, {"before", "after"}, {{1, 2}, {0.5, NAN}}};
  EXPECT_EQ(Count(Svg(bars), "<title>"), 3u);
}

TEST(SvgFile, StandsAlone_WithTheSameDrawing) {
  const std::string svg = Svg(Line(100)), file = SvgFile(svg);
  EXPECT_TRUE(file.starts_with("<svg xmlns='http://www.w3.org/2000/svg' viewBox="));
  EXPECT_EQ(file.find("var("), file.npos);  // viewers without a style sheet show it, too
  EXPECT_NE(file.find("svg .s0{stroke:#0072b2}"), file.npos);
  EXPECT_NE(file.find(svg.substr(svg.find("<path"))), file.npos);
}

TEST(Axis, TicksAreRoundAndInsideTheRange) {
  for (const double high : {0.0013, 0.7, 1.0, 9.9, 123.0, 4e5}) {
    const Axis axis({0, high}, false, false);
    EXPECT_GE(axis.ticks().size(), 3u) << high;
    EXPECT_LE(axis.ticks().size(), 9u) << high;
    for (const double tick : axis.ticks()) {
      EXPECT_GE(axis.Place(tick), -1e-9);
      EXPECT_LE(axis.Place(tick), 1 + 1e-9);
      EXPECT_NEAR(std::stod(axis.Label(tick)), tick, 1e-9 * high) << axis.Label(tick);
    }
  }
}

TEST(Number, KeepsSignificantDigits) {
  EXPECT_EQ(Number(0), "0");
  EXPECT_EQ(Number(1.23456), "1.23");
  EXPECT_EQ(Number(-0.00123456), "-0.00123");
  EXPECT_EQ(Number(123456.7), "123457");
  EXPECT_EQ(Number(1.5e-7), "1.50e-07");
  EXPECT_EQ(Number(NAN), "-");
}

}  // namespace
}  // namespace armcal::report
