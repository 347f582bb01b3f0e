// methods - by Gram matrices of orthonormal directions: columns repeat each other, and rows are many.
#include "host_sim/identify/methods/augmented_regression.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>

#include "host_sim/identify/calibration/tall_product.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kOrder = 10;            // of the residual's autoregressive model
constexpr int kRounds = 2;            // of fitting it anew
constexpr double kSameColumn = 1e-5;  // share of a column's norm below which a direction of the columns repeats others
constexpr double kNegligible = 1e-3;  // ... of what instruments leave: noise so small biases by its square
constexpr double kTold = 0.1;         // share of such a direction that must lie outside the columns: below, instruments
                                      // explain so little of it that nothing can be said
constexpr double kExact = 1e-8;       // share of the torque: a residual this small is rounding, no error
constexpr double kRowsPerColumn = 3;

MatrixXd UnitColumns(const MatrixXd& M) {
  const VectorXd norm = M.colwise().norm().transpose().cwiseMax(1e-300);
  return M * norm.cwiseInverse().asDiagonal();
}

// The directions of M (columns of unit norm) that are longer than `floor`, as orthonormal columns.
MatrixXd Directions(const MatrixXd& M, double floor) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(SelfProduct(M));
  const auto keep = (eigen.eigenvalues().array() > floor * floor).count();
  return M * (eigen.eigenvectors().rightCols(keep) *
              eigen.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal());
}

// What the directions Q do not explain of Y; twice, since those of a long Gram matrix are orthogonal to six digits.
MatrixXd Outside(const MatrixXd& Q, const MatrixXd& Y) {
  const MatrixXd once = Y - Q * (Q.transpose() * Y);
  return once - Q * (Q.transpose() * once);
}

// Coefficients a of e_k = sum a_i e_(k-i) + white (Yule and Walker).
VectorXd Autoregression(const VectorXd& e, const std::vector<Piece>& pieces) {
  VectorXd r = VectorXd::Zero(kOrder + 1);
  for (int lag = 0; lag <= kOrder; ++lag)
    for (const auto& [first, count] : pieces)
      if (count > lag) r[lag] += e.segment(first + lag, count - lag).dot(e.segment(first, count - lag));
  MatrixXd R(kOrder, kOrder);
  for (int i = 0; i < kOrder; ++i)
    for (int k = 0; k < kOrder; ++k) R(i, k) = r[std::abs(i - k)];
  R.diagonal().array() += 1e-9 * r[0];
  return R.ldlt().solve(r.tail(kOrder));
}

// Rows minus what the model predicts of them; those with a whole past.
MatrixXd Whiten(const MatrixXd& M, const VectorXd& a, const std::vector<Piece>& pieces) {
  Eigen::Index rows = 0;
  for (const Piece& p : pieces) rows += std::max<Eigen::Index>(0, p.count - kOrder);
  MatrixXd out(rows, M.cols());
  Eigen::Index next = 0;
  for (const auto& [first, count] : pieces) {
    if (count <= kOrder) continue;
    auto white = out.middleRows(next, count - kOrder);
    white = M.middleRows(first + kOrder, count - kOrder);
    for (int i = 0; i < kOrder; ++i) white -= a[i] * M.middleRows(first + kOrder - 1 - i, count - kOrder);
    next += count - kOrder;
  }
  return out;
}

// Least squares of the last column on the first `columns`, from the Gram matrix of all.
struct LeastSquares {
  LeastSquares(const MatrixXd& gram, Eigen::Index columns) {
    const VectorXd unit = gram.diagonal().head(columns).cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(unit.asDiagonal() * gram.topLeftCorner(columns, columns) * unit.asDiagonal()));
    rank = (eigen.eigenvalues().array() > kSameColumn * kSameColumn).count();
    const MatrixXd V = unit.asDiagonal() * eigen.eigenvectors().rightCols(rank);
    const VectorXd g = V.transpose() * gram.col(gram.cols() - 1).head(columns);
    const VectorXd y = g.cwiseQuotient(eigen.eigenvalues().tail(rank));
    x = V * y, explained = g.dot(y);
  }
  VectorXd x;
  Eigen::Index rank;
  double explained;  // of the last column's squares
};

}  // namespace

JointExogeneity AugmentedRegression(const JointRows& rows) {
  JointExogeneity out;
  const MatrixXd scaled = UnitColumns(rows.X), X = Directions(scaled, kSameColumn);
  MatrixXd V = Directions(Outside(Directions(UnitColumns(rows.Z), kSameColumn), scaled), kNegligible);
  if (V.cols() > 0) V = Directions(Outside(X, V), kTold);
  const auto k = X.cols(), q = V.cols();
  MatrixXd all(X.rows(), q + k + 1);  // the last k + 1 are the plain equation
  all << V, X, Outside(X, rows.tau);
  const auto plain_part = all.rightCols(k + 1);
  const VectorXd residual = all.rightCols(1);
  const auto samples = static_cast<double>(residual.size());
  out.left_Nm = residual.norm() / std::sqrt(samples);
  if (residual.norm() <= kExact * rows.tau.norm()) return out;
  // Least squares takes slow noise for slow columns, so that its residual looks faster than the noise is; the whitened
  // rows' solution does not (Cochrane and Orcutt).
  VectorXd a = Autoregression(residual, rows.pieces);
  for (int round = 0; round < kRounds; ++round) {
    const MatrixXd white = Whiten(plain_part, a, rows.pieces);
    if (white.rows() <= k) return out;
    const LeastSquares fit(SelfProduct(white), k);
    a = Autoregression(residual - X * fit.x, rows.pieces);
  }
  const MatrixXd white = Whiten(all, a, rows.pieces);
  out.rows = static_cast<int>(white.rows());
  if (q == 0 || static_cast<double>(out.rows) < kRowsPerColumn * static_cast<double>(k + q)) return out;
  const MatrixXd gram = SelfProduct(white);
  const LeastSquares plain(gram.bottomRightCorner(k + 1, k + 1), k), augmented(gram, q + k);
  if (augmented.rank <= plain.rank) return out;
  const auto free = static_cast<double>(white.rows() - augmented.rank);
  out.restrictions = static_cast<int>(augmented.rank - plain.rank);
  out.F = std::max(0.0, augmented.explained - plain.explained) / out.restrictions /
          ((gram(q + k, q + k) - augmented.explained) / free);
  out.p = cdf(complement(boost::math::fisher_f(out.restrictions, free), out.F));
  out.bias_Nm = (X * (plain.x - augmented.x.tail(k))).norm() / std::sqrt(samples);
  return out;
}

}  // namespace armcal::calibration
