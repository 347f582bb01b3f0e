// tests - scalars that a generated header is run with to learn about it: one counts, one carries its rounding bound.
#pragma once

#include <cmath>

namespace armcal::tests {

// Counts every product and every sum; a unary minus and a comparison are free.
struct Counted {
  double value = 0;
  static inline int multiplications = 0, additions = 0, sincos = 0;

  Counted() = default;
  explicit Counted(double v) : value(v) {}
  friend Counted operator-(Counted a) { return Counted(-a.value); }
  friend Counted operator+(Counted a, Counted b) { return ++additions, Counted(a.value + b.value); }
  friend Counted operator-(Counted a, Counted b) { return ++additions, Counted(a.value - b.value); }
  friend Counted operator*(Counted a, Counted b) { return ++multiplications, Counted(a.value * b.value); }
  friend bool operator<(Counted a, Counted b) { return a.value < b.value; }
  friend bool operator>(Counted a, Counted b) { return a.value > b.value; }
  friend Counted sin(Counted a) { return ++sincos, Counted(std::sin(a.value)); }
  friend Counted cos(Counted a) { return ++sincos, Counted(std::cos(a.value)); }
};

// A value in double and a bound on what a float calculation of the same expression may be off by (running error
// analysis, Higham, Accuracy and Stability of Numerical Algorithms, 3.3). With |x^ - x| <= e for the operands and u =
// 2^-24:
//   a + b: e = ea + eb + u (|a + b| + ea + eb)        rounding once, of the sum of what float holds
//   a b:   e = |a| eb + |b| ea + ea eb + u (|a b| + |a| eb + |b| ea + ea eb)
// Constants are rounded once, u |c|; inputs are exact (the test draws floats). A fused multiply-add rounds once, where
// this counts two: the bound holds for it, too. sin, cos: 1.2e-7 absolute (elementary.hpp), plus the argument's own
// error. Underflow adds less than 1e-38 an operation and is left out: the tested values are far from it.
struct Bounded {
  static constexpr double kU = 1.0 / (1 << 24);
  double value = 0, error = 0;

  Bounded() = default;
  Bounded(double v, double e) : value(v), error(e) {}
  explicit Bounded(double constant) : value(constant), error(kU * std::abs(constant)) {}
  friend Bounded operator-(Bounded a) { return {-a.value, a.error}; }
  friend Bounded operator+(Bounded a, Bounded b) {
    const double sum = a.value + b.value, e = a.error + b.error;
    return {sum, e + kU * (std::abs(sum) + e)};
  }
  friend Bounded operator-(Bounded a, Bounded b) { return a + (-b); }
  friend Bounded operator*(Bounded a, Bounded b) {
    const double product = a.value * b.value;
    const double e = std::abs(a.value) * b.error + std::abs(b.value) * a.error + a.error * b.error;
    return {product, e + kU * (std::abs(product) + e)};
  }
  friend bool operator<(Bounded a, Bounded b) { return a.value < b.value; }
  friend bool operator>(Bounded a, Bounded b) { return a.value > b.value; }
  friend Bounded sin(Bounded a) { return {std::sin(a.value), a.error + 1.2e-7}; }
  friend Bounded cos(Bounded a) { return {std::cos(a.value), a.error + 1.2e-7}; }
};

}  // namespace armcal::tests
