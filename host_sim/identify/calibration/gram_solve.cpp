// calibration - LDL' of the scaled Gram matrix; Householder reduction of stacked triangles and blocks.
#include "host_sim/identify/calibration/gram_solve.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <limits>

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Solved SolveNormal(const MatrixXd& gram, const VectorXd& right) {
  const auto n = gram.rows();
  VectorXd scale(n);
  int seen = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool zero = !(gram(i, i) > 0);
    scale[i] = zero ? 0 : 1 / std::sqrt(gram(i, i));
    seen += !zero;
  }
  MatrixXd scaled = scale.asDiagonal() * gram * scale.asDiagonal();
  for (Eigen::Index i = 0; i < n; ++i)
    if (scale[i] == 0) scaled(i, i) = 1;
  const VectorXd target = scale.cwiseProduct(right);
  const Eigen::LDLT<MatrixXd> factor(scaled);
  VectorXd z = factor.solve(target);
  z += factor.solve(target - scaled * z);
  const bool definite = factor.info() == Eigen::Success && factor.isPositive();
  const double inverse = definite ? factor.rcond() : 0;
  Solved s;
  s.x = scale.cwiseProduct(z);
  s.condition = inverse > 0 ? 1 / inverse : std::numeric_limits<double>::infinity();
  s.rank = seen;
  return s;
}

StreamingQr::StreamingQr(const VectorXd& scale, int block_rows)
    : scale_(scale),
      stack_(MatrixXd::Zero(scale.size() + 1 + block_rows, scale.size() + 1)),
      filled_(static_cast<int>(scale.size()) + 1) {}

void StreamingQr::AddRow(const VectorXd& a, double y, double weight) {
  stack_.row(filled_).head(columns()) = weight * a.cwiseProduct(scale_).transpose();
  stack_(filled_, columns()) = weight * y;
  if (++filled_ == stack_.rows()) Reduce();
}

void StreamingQr::Reduce() {
  const int size = columns() + 1;
  stack_.bottomRows(stack_.rows() - filled_).setZero();
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> factor(stack_);  // in place
  stack_.topRows(size).triangularView<Eigen::StrictlyLower>().setZero();
  filled_ = size;
}

Solved StreamingQr::Solve() {
  Reduce();
  const int n = columns();
  // Columns that others explain to within rounding carry nothing: the threshold is Eigen's, n x 2.2e-16 of the largest
  // pivot.
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> factor(stack_.topLeftCorner(n, n));
  Solved s;
  s.orthogonal = true;
  s.rank = static_cast<int>(factor.rank());
  s.x = scale_.cwiseProduct(factor.solve(stack_.col(n).head(n)));
  const auto pivots = factor.matrixQTZ().diagonal().head(factor.rank()).cwiseAbs();
  const double ratio = s.rank == n && n > 0 ? pivots.maxCoeff() / pivots.minCoeff() : 0;
  s.condition = ratio > 0 ? ratio * ratio : std::numeric_limits<double>::infinity();
  return s;
}

}  // namespace armcal::calibration
