// excitation - the terms of equation (27) and their derivatives; knows no limits and no model.
#include "host_sim/excitation/fourier.hpp"

#include <numbers>

namespace armcal::excitation {

double Fourier::period_s() const { return 2 * std::numbers::pi / frequency_radps; }

codegen::Signals Fourier::At(const Eigen::VectorXd& t) const {
  codegen::Signals s;
  s.t = t;
  s.q = FourierBasis(t, frequency_radps, harmonics(), 0) * coefficient;
  s.qd = FourierBasis(t, frequency_radps, harmonics(), 1) * coefficient;
  s.qdd = FourierBasis(t, frequency_radps, harmonics(), 2) * coefficient;
  return s;
}

Fourier Fourier::Scaled(double factor) const {
  Fourier scaled = *this;
  scaled.coefficient.topRows(2 * harmonics()) *= factor;
  return scaled;
}

Eigen::MatrixXd FourierBasis(const Eigen::VectorXd& t, double frequency_radps, int harmonics, int order) {
  Eigen::MatrixXd basis(t.size(), 2 * harmonics + 1);
  for (int l = 1; l <= harmonics; ++l) {
    const double w = frequency_radps * l;
    const Eigen::ArrayXd sine = (w * t.array()).sin(), cosine = (w * t.array()).cos();
    auto a = basis.col(l - 1).array(), b = basis.col(harmonics + l - 1).array();
    if (order == 0) a = sine / w, b = -cosine / w;
    else if (order == 1) a = cosine, b = sine;
    else a = -w * sine, b = w * cosine;
  }
  basis.col(2 * harmonics).setConstant(order == 0 ? 1 : 0);
  return basis;
}

}  // namespace armcal::excitation
