// report tests - check that colour-blind readers can tell the colours of a picture's series from each other.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "host_sim/data/report/assets.hpp"
#include "host_sim/data/report/canvas.hpp"
#include "host_sim/data/report/style.hpp"

namespace armcal::report {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

// Machado, Oliveira, Fernandes 2009, severity 1: how linear RGB looks without one kind of cone.
const Matrix kSeen[] = {
    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
    {{{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}}},
    {{{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}}},
    {{{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}}};
constexpr Matrix kToXyz = {{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};

Vector Times(const Matrix& m, const Vector& v) {
  Vector out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) out[i] += m[i][k] * v[k];
  return out;
}

// "#0072b2" or "#555", as linear RGB.
Vector Linear(std::string hex) {
  if (hex.size() == 4) hex = {'#', hex[1], hex[1], hex[2], hex[2], hex[3], hex[3]};
  Vector out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double value = std::stoi(hex.substr(1 + 2 * k, 2), nullptr, 16) / 255.0;
    out[k] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  }
  return out;
}

// CIE L*a*b* of linear RGB, white D65.
Vector Lab(Vector rgb) {
  for (double& value : rgb) value = std::min(1.0, std::max(0.0, value));
  const Vector xyz = Times(kToXyz, rgb);
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
  const double x = f(xyz[0] / 0.9505), y = f(xyz[1]), z = f(xyz[2] / 1.089);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

// The values of c0, c1, ... in a style sheet's text.
std::vector<std::string> Colours(std::string_view css) {
  std::vector<std::string> out;
  for (int k = 0; k < kColours; ++k) {
    const std::string key = "--c" + std::to_string(k) + ":";
    const std::size_t begin = css.find('#', css.find(key));
    out.emplace_back(css.substr(begin, css.find(';', begin) - begin));
  }
  return out;
}

void ExpectApart(const std::vector<std::string>& colours) {
  constexpr double kApart = 10;  // a difference of 2 to 3 is seen side by side only
  for (const Matrix& seen : kSeen)
    for (std::size_t a = 0; a < colours.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const Vector one = Lab(Times(seen, Linear(colours[a]))), other = Lab(Times(seen, Linear(colours[b])));
        EXPECT_GT(std::hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]), kApart)
            << colours[a] << " and " << colours[b] << ", kind " << &seen - kSeen;
      }
}

TEST(Colours, OnLightGround_AreToldApartByColourBlindReaders) { ExpectApart(Colours(kLight)); }

TEST(Colours, OnDarkGround_AreToldApartByColourBlindReaders) {
  const std::string_view css = assets::kPageStyle;
  ExpectApart(Colours(css.substr(css.find("prefers-color-scheme: dark"))));
}

TEST(Colours, OnPaper_AreThoseOfLightGround) {
  const std::string_view css = assets::kPageStyle;
  EXPECT_EQ(Colours(css.substr(css.find("@media print"))), Colours(kLight));
}

}  // namespace
}  // namespace armcal::report
