// diagnosis - solving for columns off the base, whitening blocks.
#include "host_sim/diagnose/diagnosis/metric_parts.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
// A column may survive the base fit with a tiny part of itself (a balancer spring leaves 0.4 %); below this it is
// round-off.
constexpr double kVisible = 2e-7;
}  // namespace

Gain SolveGain(const Eigen::LLT<MatrixXd>& base, const Projection& p) {
  const int k = static_cast<int>(p.g.size());
  const VectorXd &g = p.g, norm2 = p.gram.diagonal();
  const MatrixXd S = p.gram - p.B.transpose() * base.solve(p.B);
  Gain out;
  out.amplitude = VectorXd::Zero(k), out.sd = VectorXd::Zero(k);
  VectorXd scale(k);
  for (int i = 0; i < k; ++i) scale[i] = norm2[i] > 0 ? 1 / std::sqrt(norm2[i]) : 0;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * S * scale.asDiagonal()));
  const VectorXd projected = eigen.eigenvectors().transpose() * scale.cwiseProduct(g);
  VectorXd inverse = VectorXd::Zero(k);
  for (int i = 0; i < k; ++i) {
    if (eigen.eigenvalues()[i] < kVisible) continue;
    inverse[i] = 1 / eigen.eigenvalues()[i];
    out.gain += projected[i] * projected[i] * inverse[i];
    ++out.rank;
  }
  const MatrixXd V = scale.asDiagonal() * eigen.eigenvectors();
  out.amplitude = V * inverse.cwiseProduct(projected);
  out.sd = (V * inverse.asDiagonal() * V.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  return out;
}

MatrixXd WhitenAll(const NoiseModel& noise, const RowIndex& rows, const MatrixXd& m) {
  if (IsWhite(noise)) return m * (1 / noise.innovation);
  MatrixXd out(m.rows(), m.cols());
  for (int c = 0; c < m.cols(); ++c) out.col(c) = Whiten(noise, rows, m.col(c));
  return out;
}

}  // namespace armcal::diagnosis
