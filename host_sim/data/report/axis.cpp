// report - places ticks at 1, 2 and 5 x 10^k.
#include "host_sim/data/report/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace armcal::report {

constexpr double kEqual = 1e-12;  // of a value

Axis::Axis(const std::vector<double>& values, bool logarithmic, bool include_zero) : logarithmic_(logarithmic) {
  double low = INFINITY, high = -INFINITY;
  for (const double v : values) {
    if (!std::isfinite(v) || (logarithmic && v <= 0)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (low > high) low = logarithmic ? 0.1 : 0, high = 1;
  if (logarithmic) low = std::log10(low), high = std::log10(high);
  if (include_zero) low = std::min(low, 0.0), high = std::max(high, 0.0);
  // What differs in its last digits only is drawn as equal.
  if (high - low <= kEqual * std::max(std::abs(low), std::abs(high)))
    low -= std::max(0.5, 0.05 * std::abs(low)), high += std::max(0.5, 0.05 * std::abs(high));
  const double margin = 0.04 * (high - low);
  low_ = include_zero && low == 0 ? 0 : low - margin;
  high_ = include_zero && high == 0 ? 0 : high + margin;
  if (logarithmic) DecadeTicks();
  else LinearTicks(6);
}

void Axis::LinearTicks(int wanted) {
  const double raw = (high_ - low_) / wanted;
  const double decade = std::pow(10, std::floor(std::log10(raw)));
  const double share = raw / decade;
  step_ = decade * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
  const double first = std::ceil(low_ / step_);
  for (int k = 0; (first + k) * step_ <= high_ + 1e-9 * step_; ++k) ticks_.push_back((first + k) * step_);
}

void Axis::DecadeTicks() {
  const double every = std::max(1.0, std::ceil((high_ - low_) / 8));
  const bool few = high_ - low_ < 2.5;  // decades: then 2 and 5 between them are wanted too
  for (double decade = std::floor(low_); decade <= high_; decade += every) {
    for (const double lead : {1.0, 2.0, 5.0}) {
      const double place = decade + std::log10(lead);
      if ((lead == 1 || few) && place >= low_ && place <= high_) ticks_.push_back(lead * std::pow(10, decade));
    }
  }
}

double Axis::Place(double value) const {
  if (logarithmic_) value = value > 0 ? std::log10(value) : NAN;
  return std::isfinite(value) ? (value - low_) / (high_ - low_) : NAN;
}

std::string Axis::Label(double tick) const {
  if (logarithmic_) return fmt::format("{:g}", tick);
  if (std::abs(tick) < 1e-9 * step_) return "0";
  const double largest = std::max(std::abs(low_), std::abs(high_));
  if (largest >= 1e5 || largest < 1e-3) return fmt::format("{:.3g}", tick);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step_) + 1e-9)));
  return fmt::format("{:.{}f}", tick, decimals);
}

std::string Number(double value, int digits) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  if (value == 0) return "0";
  const int decade = static_cast<int>(std::floor(std::log10(std::abs(value))));
  if (decade < -4 || decade >= 6) return fmt::format("{:.{}e}", value, digits - 1);
  return fmt::format("{:.{}f}", value, std::max(0, digits - 1 - decade));
}

}  // namespace armcal::report
