// excitation - the periodic curves of the survey's section 4. All are linear in their coefficients.
#pragma once

#include <Eigen/Core>
#include <string>

#include "codegen/src/generator/model.hpp"

namespace armcal::excitation {

// Row i of the coefficients multiplies term i; the last row is q0 (rad).
enum class Family {
  kFourier,     // (27): a_l / (w l) sin(w l t) - b_l / (w l) cos(w l t), rows a_1..a_L, b_1..b_L (rad/s), w = 2 pi / T
  kSine,        // a_l / (w l) sin(w l t), rows a_1..a_n (rad/s)
  kPolynomial,  // 64 s^3 (1 - s)^3 sum_k c_k T_k(2 s - 1), s = t / T, T_k of Chebyshev: at rest at both ends; c (rad)
  kSpline       // quintic B-splines on a uniform periodic grid, rows: their weights (rad)
};
inline constexpr Family kFamilies[] = {Family::kFourier, Family::kSine, Family::kPolynomial, Family::kSpline};
const char* Name(Family family);
Family FamilyNamed(const std::string& name);  // InputError: none of them

// Derivative `order` (0, 1, 2) of each term and of the offset at the times t: [t.size() x terms + 1]. Multiplied by the
// coefficients it gives the motion.
Eigen::MatrixXd Basis(Family family, const Eigen::VectorXd& t, double period_s, int terms, int order);

struct Series {
  Family family = Family::kFourier;
  double period_s = 10;
  Eigen::MatrixXd coefficient;  // [terms + 1 x joints]

  int joints() const { return static_cast<int>(coefficient.cols()); }
  int terms() const { return static_cast<int>(coefficient.rows()) - 1; }
  auto offset() const { return coefficient.row(terms()); }

  // The motion at the times t: q, qd, qdd are [t.size() x joints].
  codegen::Signals At(const Eigen::VectorXd& t) const;

  // The same series with the amplitude of every joint multiplied by `factor`; the offset stays.
  Series Scaled(double factor) const;
};

}  // namespace armcal::excitation
