// tests - a complex number that orders by its real part: derivatives without differences (Squire and Trapp 1998).
// Knows no graph; works as the scalar of anything written for T.
#pragma once

#include <complex>

namespace armcal::tests {

struct Complex {
  std::complex<double> z;
  Complex(double re = 0, double im = 0) : z(re, im) {}
  explicit Complex(std::complex<double> value) : z(value) {}

  friend Complex operator-(Complex a) { return Complex(-a.z); }
  friend Complex operator+(Complex a, Complex b) { return Complex(a.z + b.z); }
  friend Complex operator-(Complex a, Complex b) { return Complex(a.z - b.z); }
  friend Complex operator*(Complex a, Complex b) { return Complex(a.z * b.z); }
  friend Complex operator/(Complex a, Complex b) { return Complex(a.z / b.z); }
  friend bool operator==(Complex a, Complex b) { return a.z.real() == b.z.real(); }
  friend bool operator<(Complex a, Complex b) { return a.z.real() < b.z.real(); }
  friend bool operator>(Complex a, Complex b) { return a.z.real() > b.z.real(); }

  // abs is the analytic one of each half plane, not the modulus.
  friend Complex abs(Complex a) { return a.z.real() < 0 ? -a : a; }
  friend Complex sin(Complex a) { return Complex(std::sin(a.z)); }
  friend Complex cos(Complex a) { return Complex(std::cos(a.z)); }
  friend Complex exp(Complex a) { return Complex(std::exp(a.z)); }
  friend Complex log(Complex a) { return Complex(std::log(a.z)); }
  friend Complex tanh(Complex a) { return Complex(std::tanh(a.z)); }
  friend Complex sqrt(Complex a) { return Complex(std::sqrt(a.z)); }
  friend Complex cbrt(Complex a) { return a.z.real() < 0 ? -cbrt(-a) : Complex(std::pow(a.z, 1.0 / 3)); }
  friend Complex pow(Complex a, Complex b) { return Complex(std::exp(b.z * std::log(a.z))); }
};

inline constexpr double kComplexStep = 1e-40;  // squares of it vanish, so nothing is cut off

inline double Slope(Complex a) { return a.z.imag() / kComplexStep; }

}  // namespace armcal::tests
