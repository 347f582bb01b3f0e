// report - chooses the range, the ticks and the labels of a numeric axis.
#pragma once

#include <string>
#include <vector>

namespace armcal::report {

class Axis {
 public:
  // Covers the finite values of `values` (a logarithmic axis: the positive ones) with a small margin.
  Axis(const std::vector<double>& values, bool logarithmic, bool include_zero);

  // Position on the axis, 0 at its start and 1 at its end; NaN for what cannot be shown.
  double Place(double value) const;

  const std::vector<double>& ticks() const { return ticks_; }
  std::string Label(double tick) const;

 private:
  void LinearTicks(int wanted);
  void DecadeTicks();

  bool logarithmic_;
  double low_ = 0, high_ = 1;
  double step_ = 1;
  std::vector<double> ticks_;
};

// A number for people: `digits` significant digits, plain where that is short, "-" for NaN.
std::string Number(double value, int digits = 3);

}  // namespace armcal::report
