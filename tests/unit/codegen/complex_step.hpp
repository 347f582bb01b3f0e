// tests - a complex number that orders by its real part: derivatives without differences (Squire and Trapp 1998).
// Knows no graph; works as the scalar of anything written for T.
#pragma once

#include <complex>

namespace armcal::tests {

// Its operations are never inlined: a model of thousands of them would take ten seconds to compile.
struct Complex {
  std::complex<double> z;
  Complex(double re = 0, double im = 0) : z(re, im) {}
  explicit Complex(std::complex<double> value) : z(value) {}

  [[gnu::noinline]] friend Complex operator-(Complex a) { return Complex(-a.z); }
  [[gnu::noinline]] friend Complex operator+(Complex a, Complex b) { return Complex(a.z + b.z); }
  [[gnu::noinline]] friend Complex operator-(Complex a, Complex b) { return Complex(a.z - b.z); }
  [[gnu::noinline]] friend Complex operator*(Complex a, Complex b) { return Complex(a.z * b.z); }
  [[gnu::noinline]] friend Complex operator/(Complex a, Complex b) { return Complex(a.z / b.z); }
  friend bool operator==(Complex a, Complex b) { return a.z.real() == b.z.real(); }
  friend bool operator<(Complex a, Complex b) { return a.z.real() < b.z.real(); }
  friend bool operator>(Complex a, Complex b) { return a.z.real() > b.z.real(); }

  // abs is the analytic one of each half plane, not the modulus.
  [[gnu::noinline]] friend Complex abs(Complex a) { return a.z.real() < 0 ? -a : a; }
  [[gnu::noinline]] friend Complex sin(Complex a) { return Complex(std::sin(a.z)); }
  [[gnu::noinline]] friend Complex cos(Complex a) { return Complex(std::cos(a.z)); }
  [[gnu::noinline]] friend Complex exp(Complex a) { return Complex(std::exp(a.z)); }
  [[gnu::noinline]] friend Complex log(Complex a) { return Complex(std::log(a.z)); }
  [[gnu::noinline]] friend Complex tanh(Complex a) { return Complex(std::tanh(a.z)); }
  [[gnu::noinline]] friend Complex sqrt(Complex a) { return Complex(std::sqrt(a.z)); }
  [[gnu::noinline]] friend Complex cbrt(Complex a) {
    return a.z.real() < 0 ? -cbrt(-a) : Complex(std::pow(a.z, 1.0 / 3));
  }
  [[gnu::noinline]] friend Complex pow(Complex a, Complex b) { return Complex(std::exp(b.z * std::log(a.z))); }
};

inline constexpr double kComplexStep = 1e-40;  // squares of it vanish, so nothing is cut off

inline double Slope(Complex a) { return a.z.imag() / kComplexStep; }

}  // namespace armcal::tests
