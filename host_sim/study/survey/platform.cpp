// survey - samples, noise, differences.
#include "host_sim/study/survey/platform.hpp"

#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

codegen::Signals Sampled(const excitation::Series& series, int samples) {
  return series.At(VectorXd::LinSpaced(samples, 0, (samples - 1) / kRate_Hz));
}

MatrixXd Noise(int samples, const VectorXd& sigma, std::uint64_t seed) {
  plant::Random random(seed);
  MatrixXd noise(samples, sigma.size());
  for (Eigen::Index k = 0; k < noise.rows(); ++k)
    for (Eigen::Index j = 0; j < noise.cols(); ++j) noise(k, j) = sigma[j] * random.Normal();
  return noise;
}

calibration::Dataset Measured(const codegen::Signals& s, const MatrixXd& tau) {
  calibration::Dataset d;
  d.s = s;
  d.tau = tau;
  d.moving = d.used = Eigen::MatrixXi::Ones(tau.rows(), tau.cols());
  d.scored = Eigen::VectorXi::Ones(tau.rows());
  d.cutoff_Hz = VectorXd::Zero(tau.cols());
  d.source = "survey platform";
  return d;
}

codegen::Signals Differentiated(const VectorXd& t, const MatrixXd& q) {
  codegen::Signals s;
  s.t = t;
  s.q = q;
  const double h = t[1] - t[0];
  const Eigen::Index n = q.rows();
  s.qd.resize(n, q.cols()), s.qdd.resize(n, q.cols());
  const auto inner = n - 2;
  s.qd.middleRows(1, inner) = (q.bottomRows(inner) - q.topRows(inner)) / (2 * h);
  s.qdd.middleRows(1, inner) = (q.bottomRows(inner) - 2 * q.middleRows(1, inner) + q.topRows(inner)) / (h * h);
  s.qd.row(0) = (q.row(1) - q.row(0)) / h, s.qd.row(n - 1) = (q.row(n - 1) - q.row(n - 2)) / h;
  s.qdd.row(0) = s.qdd.row(1), s.qdd.row(n - 1) = s.qdd.row(n - 2);
  return s;
}

codegen::Signals Differentiated(const codegen::Signals& s, double noise_rad, std::uint64_t seed) {
  return Differentiated(s.t, s.q + Noise(s.samples(), VectorXd::Constant(s.q.cols(), noise_rad), seed));
}

codegen::Signals Filtered(const VectorXd& t, const MatrixXd& q, double cutoff_Hz) {
  MatrixXd smooth = q;
  for (Eigen::Index j = 0; j < q.cols(); ++j)
    smooth.col(j) = logs::ZeroPhaseLowPass(q.col(j), cutoff_Hz, 1 / (t[1] - t[0]));
  return Differentiated(t, smooth);
}

}  // namespace armcal::survey
