// excitation - the finite Fourier series of the survey, equation (27); knows no limits and no model.
#pragma once

#include <Eigen/Core>

#include "codegen/src/generator/model.hpp"

namespace armcal::excitation {

// q_i(t) = q0_i + sum_l a_il / (w l) sin(w l t) - b_il / (w l) cos(w l t), l = 1..L.
struct Fourier {
  double frequency_radps = 0;   // w
  Eigen::MatrixXd coefficient;  // [2 L + 1 x joints]: rows a_1..a_L, b_1..b_L (rad/s), q0 (rad)

  int joints() const { return static_cast<int>(coefficient.cols()); }
  int harmonics() const { return static_cast<int>(coefficient.rows() - 1) / 2; }
  double period_s() const;

  // The motion at the times t: q, qd, qdd are [t.size() x joints].
  codegen::Signals At(const Eigen::VectorXd& t) const;

  // The same series with the amplitude of every joint multiplied by `factor`; q0 stays.
  Fourier Scaled(double factor) const;
};

// Derivative `order` (0, 1, 2) of each term at the times t: [t.size() x 2 L + 1]; times the coefficients it is the
// motion.
Eigen::MatrixXd FourierBasis(const Eigen::VectorXd& t, double frequency_radps, int harmonics, int order);

}  // namespace armcal::excitation
