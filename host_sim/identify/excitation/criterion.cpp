// excitation - computes the criteria from a Gram matrix, with their derivatives.
#include "host_sim/identify/excitation/criterion.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace armcal::excitation {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNorm = 10;  // p of the surrogate
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Eigenvalues and vectors of the Gram matrix of unit columns; ok: K is not singular.
struct Axes {
  VectorXd value;
  MatrixXd vector, scaled;
  VectorXd scale;  // of the columns, to unit norm
  bool ok = false;
};

Axes AxesOf(const MatrixXd& gram) {
  Axes out;
  if (!(gram.diagonal().minCoeff() > 0)) return out;
  out.scale = gram.diagonal().cwiseSqrt().cwiseInverse();
  out.scaled = out.scale.asDiagonal() * gram * out.scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(out.scaled);
  out.value = solver.eigenvalues();
  out.vector = solver.eigenvectors();
  // Squaring K halves the digits: below this the smallest eigenvalue is round-off.
  const auto n = gram.rows();
  out.ok = out.value[0] > out.value[n - 1] * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  return out;
}

MatrixXd Inverse(const Axes& a) {  // of the matrix of unit columns
  return a.vector * a.value.cwiseInverse().asDiagonal() * a.vector.transpose();
}

double SmoothCondition(const Axes& a, const MatrixXd& gram, MatrixXd& derivative) {
  const Eigen::ArrayXd up = a.value.array().pow(kNorm / 2), down = a.value.array().pow(-kNorm / 2);
  const VectorXd d_value = (up / up.sum() - down / down.sum()) / (2 * a.value.array());
  const MatrixXd d_scaled = a.vector * d_value.asDiagonal() * a.vector.transpose();
  derivative = a.scale.asDiagonal() * d_scaled * a.scale.asDiagonal();
  // The scaling depends on the diagonal, too.
  derivative.diagonal() -= d_scaled.cwiseProduct(a.scaled).rowwise().sum().cwiseQuotient(gram.diagonal());
  return (std::log(up.sum()) + std::log(down.sum())) / kNorm;
}

}  // namespace

double Figure(const Criterion& criterion, const MatrixXd& gram) {
  MatrixXd unused;
  if (criterion.kind != Criterion::Kind::kCondition) return std::exp(SmoothFigure(criterion, gram, unused));
  const Axes a = AxesOf(gram);
  return a.ok ? std::sqrt(a.value[a.value.size() - 1] / a.value[0]) : kInfinity;
}

double SmoothFigure(const Criterion& criterion, const MatrixXd& gram, MatrixXd& derivative) {
  const Axes a = AxesOf(gram);
  if (!a.ok) return kInfinity;
  if (criterion.kind == Criterion::Kind::kCondition) return SmoothCondition(a, gram, derivative);
  const MatrixXd inverse = a.scale.asDiagonal() * Inverse(a) * a.scale.asDiagonal();
  if (criterion.kind == Criterion::Kind::kDOptimal) {
    const double count = 2 * static_cast<double>(gram.rows());
    derivative = -inverse / count;
    return (2 * a.scale.array().log().sum() - a.value.array().log().sum()) / count;
  }
  const double count = 2 * static_cast<double>(criterion.about.size());
  derivative.setZero(gram.rows(), gram.cols());
  double sum = 0;
  for (const int i : criterion.about) {
    sum += std::log(inverse(i, i));
    derivative.noalias() -= inverse.col(i) * inverse.row(i) / (count * inverse(i, i));
  }
  return sum / count;
}

VectorXd Deviations(const MatrixXd& gram) {
  const Axes a = AxesOf(gram);
  if (!a.ok) return VectorXd::Constant(gram.rows(), kInfinity);
  return Inverse(a).diagonal().cwiseSqrt().cwiseProduct(a.scale);
}

VectorXd Separation(const MatrixXd& gram) {
  const Axes a = AxesOf(gram);
  if (!a.ok) return VectorXd::Zero(gram.rows());
  return Inverse(a).diagonal().cwiseSqrt().cwiseInverse();
}

}  // namespace armcal::excitation
