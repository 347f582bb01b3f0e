// excitation - the terms of each family of curves, and their derivatives.
#include "host_sim/identify/excitation/series.hpp"

#include <cmath>
#include <numbers>

#include "codegen/src/io/input_error.hpp"

namespace armcal::excitation {
namespace {

using Eigen::ArrayXd;

// sin(x) / w if `sine`, else -cos(x) / w, x = w t, and their derivatives by t.
ArrayXd Wave(const Eigen::VectorXd& t, double w, bool sine, int order) {
  const ArrayXd x = w * t.array();
  if (order == 0) return sine ? (x.sin() / w).eval() : (-x.cos() / w).eval();
  if (order == 1) return sine ? x.cos().eval() : x.sin().eval();
  return sine ? (-w * x.sin()).eval() : (w * x.cos()).eval();
}

// Chebyshev polynomial k at x with its first and second derivative, by their recurrence.
struct Jet {
  ArrayXd value, first, second;
};
Jet Chebyshev(const ArrayXd& x, int k) {
  const ArrayXd zero = ArrayXd::Zero(x.size()), one = ArrayXd::Ones(x.size());
  Jet before{one, zero, zero}, now{x, one, zero};
  if (k == 0) return before;
  for (int i = 1; i < k; ++i) {
    Jet next{2 * x * now.value - before.value, 2 * now.value + 2 * x * now.first - before.first,
             4 * now.first + 2 * x * now.second - before.second};
    before = now, now = next;
  }
  return now;
}

// Window times Chebyshev polynomial k, s in [0, 1].
ArrayXd Windowed(const ArrayXd& s, int k, double period_s, int order) {
  const ArrayXd p = s * (1 - s), p1 = 1 - 2 * s;  // (p^3)' = 3 p^2 p', p'' = -2
  const Jet window{64 * p.cube(), 64 * 3 * p.square() * p1, 64 * (6 * p * p1.square() - 6 * p.square())};
  const Jet t = Chebyshev(2 * s - 1, k);  // d / ds = 2 d / dx
  if (order == 0) return window.value * t.value;
  if (order == 1) return (window.first * t.value + 2 * window.value * t.first) / period_s;
  return (window.second * t.value + 4 * window.first * t.first + 4 * window.value * t.second) / (period_s * period_s);
}

// The quintic B-spline on the knots 0..6 by truncated powers, scaled to a peak of about 1; derivative by its argument.
ArrayXd BSpline(const ArrayXd& u, int order) {
  constexpr double kBinomial[] = {1, -6, 15, -20, 15, -6, 1};
  constexpr double kPeak = 66.0 / 120;  // B(3)
  const double factor = (order == 0 ? 1.0 / 120 : order == 1 ? 1.0 / 24 : 1.0 / 6) / kPeak;
  ArrayXd out = ArrayXd::Zero(u.size());
  for (int k = 0; k < 7; ++k) out += kBinomial[k] * (u - k).max(0).pow(5 - order);
  return (u < 6).select(factor * out, 0);
}

// Spline i of n on a period. The part beyond the end of the period is added at its begin.
ArrayXd Periodic(const ArrayXd& s, int i, int n, double period_s, int order) {
  const double per_s = n / period_s;
  ArrayXd out = ArrayXd::Zero(s.size());
  for (int turn = 0; turn <= (5 + n) / n; ++turn) out += BSpline(s * n - i + turn * n, order);
  return out * std::pow(per_s, order);
}

}  // namespace

const char* Name(Family family) {
  constexpr const char* kName[] = {"fourier", "sine", "polynomial", "spline"};
  return kName[static_cast<int>(family)];
}

Family FamilyNamed(const std::string& name) {
  for (const Family family : kFamilies)
    if (name == Name(family)) return family;
  throw io::InputError("trajectory family " + name + ": expected fourier, sine, polynomial or spline");
}

Eigen::MatrixXd Basis(Family family, const Eigen::VectorXd& t, double period_s, int terms, int order) {
  Eigen::MatrixXd basis(t.size(), terms + 1);
  const double w = 2 * std::numbers::pi / period_s;
  const ArrayXd turns = t.array() / period_s, s = turns - turns.floor();
  for (int i = 0; i < terms; ++i) {
    const int half = terms / 2;
    switch (family) {
      case Family::kFourier:
        basis.col(i) = i < half ? Wave(t, w * (i + 1), true, order) : Wave(t, w * (i - half + 1), false, order);
        break;
      case Family::kSine:
        basis.col(i) = Wave(t, w * (i + 1), true, order);
        break;
      case Family::kPolynomial:
        basis.col(i) = Windowed(s, i, period_s, order);
        break;
      case Family::kSpline:
        basis.col(i) = Periodic(s, i, terms, period_s, order);
        break;
    }
  }
  basis.col(terms).setConstant(order == 0 ? 1 : 0);
  return basis;
}

codegen::Signals Series::At(const Eigen::VectorXd& t) const {
  codegen::Signals s;
  s.t = t;
  s.q = Basis(family, t, period_s, terms(), 0) * coefficient;
  s.qd = Basis(family, t, period_s, terms(), 1) * coefficient;
  s.qdd = Basis(family, t, period_s, terms(), 2) * coefficient;
  return s;
}

Series Series::Scaled(double factor) const {
  Series scaled = *this;
  scaled.coefficient.topRows(terms()) *= factor;
  return scaled;
}

}  // namespace armcal::excitation
