// math - the packed kernels against dense Eigen algebra in double.
#include "armcal/math/symmetric.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "armcal/math/columns.hpp"

namespace armcal::math {
namespace {

constexpr int n = 9;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Matrix Dense(const double* ud) {
  Matrix u = Matrix::Identity(n, n), d = Matrix::Zero(n, n);
  for (int j = 0; j < n; ++j) {
    d(j, j) = ud[UdIndex(j, j)];
    for (int i = 0; i < j; ++i) u(i, j) = ud[UdIndex(i, j)];
  }
  return u * d * u.transpose();
}

struct Ud : testing::Test {
  std::mt19937 random{7};
  std::normal_distribution<double> normal;
  double ud[UdSize(n)];
  Vector Random(int size) {
    return Vector::NullaryExpr(size, [&] { return normal(random); });
  }
  Matrix Start() {
    Matrix w = Matrix::NullaryExpr(n, 14, [&] { return normal(random); });
    Eigen::Matrix<double, -1, -1, Eigen::RowMajor> rows = w;
    UdFromSquareRoot<n, 14>(rows.data(), ud);
    return w * w.transpose();
  }
};

TEST_F(Ud, FromSquareRoot_GivesTheProductAndOrthogonalRows) {
  Matrix w = Matrix::NullaryExpr(n, 14, [&] { return normal(random); });
  Eigen::Matrix<double, -1, -1, Eigen::RowMajor> rows = w;
  UdFromSquareRoot<n, 14>(rows.data(), ud);
  EXPECT_LT((Dense(ud) - w * w.transpose()).norm(), 1e-12);
  const Matrix gram = rows * rows.transpose();
  for (int j = 0; j < n; ++j) EXPECT_NEAR(gram(j, j), ud[UdIndex(j, j)], 1e-12);
  EXPECT_LT((gram - Matrix(gram.diagonal().asDiagonal())).norm(), 1e-12);
}

TEST_F(Ud, FromSquareRoot_OfDependentRows_GivesZeroDAndTheSameProduct) {
  Matrix w = Matrix::NullaryExpr(n, 14, [&] { return normal(random); });
  w.row(3) = 2 * w.row(5) - w.row(8);
  Eigen::Matrix<double, -1, -1, Eigen::RowMajor> rows = w;
  UdFromSquareRoot<n, 14>(rows.data(), ud);
  EXPECT_EQ(ud[UdIndex(3, 3)], 0.0);
  EXPECT_LT((Dense(ud) - w * w.transpose()).norm(), 1e-12);
}

TEST_F(Ud, Add_IsTheRankOneSum) {
  const Matrix p = Start();
  Vector a = Random(n);
  a(4) = 0;
  Vector copy = a;
  UdAdd<n>(ud, 0.7, copy.data());
  EXPECT_LT((Dense(ud) - (p + 0.7 * a * a.transpose())).norm(), 1e-11);
}

TEST_F(Ud, Add_ToAZeroMatrix_GivesTheVectorsSquare) {
  for (double& u : ud) u = 0;
  Vector a = Random(n), copy = a;
  UdAdd<n>(ud, 2.0, copy.data());
  EXPECT_LT((Dense(ud) - 2 * a * a.transpose()).norm(), 1e-12);
}

TEST_F(Ud, DiagonalScaleAndSolve_AgreeWithDenseAlgebra) {
  const Matrix p = Start();
  double diagonal[n];
  UdDiagonal<n>(ud, diagonal);
  for (int i = 0; i < n; ++i) EXPECT_NEAR(diagonal[i], p(i, i), 1e-11);
  Vector s = Random(n).cwiseAbs(), inverse = s.cwiseInverse();
  UdScale<n>(ud, s.data(), inverse.data());
  EXPECT_LT((Dense(ud) - s.asDiagonal() * p * s.asDiagonal()).norm(), 1e-10);
  Matrix u = Matrix::Identity(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < j; ++i) u(i, j) = ud[UdIndex(i, j)];
  Vector b = Random(n), x = b;
  UdSolveUpper<n>(ud, x.data());
  EXPECT_LT((u * x - b).norm(), 1e-9);
}

// Two columns at once must be one after the other to the bit, at every length of the remainder.
TEST_F(Ud, ColumnsInPairs_GiveTheBitsOfOneByOne) {
  for (int length = 0; length < 12; ++length) {
    const Vector a = Random(12), b = Random(12), x = Random(12);
    Vector u1 = a, u2 = b, gain = x, v1 = a, v2 = b, pair = x;
    BiermanColumn(u1.data(), gain.data(), 0.3, 1.7, length);
    BiermanColumn(u2.data(), gain.data(), -0.2, 0.4, length);
    BiermanColumns(v1.data(), v2.data(), pair.data(), 0.3, 1.7, -0.2, 0.4, length);
    EXPECT_TRUE(u1 == v1 && u2 == v2 && gain == pair) << length;
    const auto dots = Dots(a.data(), b.data(), x.data(), length, 0.5, 0.25);
    EXPECT_EQ(dots.first, Dot(a.data(), x.data(), length, 0.5));
    EXPECT_EQ(dots.second, Dot(b.data(), x.data(), length, 0.25));
    EXPECT_NEAR(dots.first, 0.5 + a.head(length).dot(x.head(length)), 1e-14);
  }
}

// One row into `stored` rows at a time; the triangle stands row by row without its diagonal.
template <int stored>
void Eliminate(double* d, double* r, double* x, int length, double* weight) {
  const std::uint8_t begin = 0;
  double rotation[2 * stored];
  GivensCorner<stored, 1>(d, r, x, length, &begin, 0, 1, weight, rotation);
  FoldBlock<1, stored, 1>(x, r, rotation, length);
}

TEST_F(Ud, GivensBlocks_GiveTheCholeskyFactorOfTheNormalMatrix) {
  constexpr double kFloor = 1e-9;
  const auto at = [](int row) { return row * n - row * (row - 1) / 2; };  // where a row of the triangle begins
  Vector packed = Vector::Zero(at(n)), d = Vector::Constant(n, kFloor);
  Matrix data = Matrix::NullaryExpr(40, n + 1, [&] { return normal(random); });
  double rss = 0;
  for (int row = 0; row < data.rows(); ++row) {
    Vector x = data.row(row);
    double weight = 1;
    for (int j = 0, stored = 1; j < n; j += stored, stored = 1 + (row + j) % 4) {
      stored = std::min(stored, n - j);
      const auto go = [&](auto call) { call(&d(j), &packed(at(j)), &x(j), n + 1 - j - stored, &weight); };
      if (stored == 1) go(Eliminate<1>);
      if (stored == 2) go(Eliminate<2>);
      if (stored == 3) go(Eliminate<3>);
      if (stored == 4) go(Eliminate<4>);
    }
    rss += weight * x(n) * x(n);
  }
  Matrix r = Matrix::Zero(n, n + 1);
  for (int j = 0; j < n; ++j) r.row(j).tail(n - j) = packed.segment(at(j), n - j);
  Matrix unit = r.leftCols(n) + Matrix::Identity(n, n);
  Matrix information = data.leftCols(n).transpose() * data.leftCols(n) + kFloor * Matrix::Identity(n, n);
  EXPECT_LT((unit.transpose() * d.asDiagonal() * unit - information).norm(), 1e-10);
  const Vector solution = unit.triangularView<Eigen::Upper>().solve(r.col(n));
  const Vector expected = data.leftCols(n).householderQr().solve(data.col(n));
  EXPECT_LT((solution - expected).norm(), 1e-8);
  EXPECT_NEAR(rss, (data.col(n) - data.leftCols(n) * expected).squaredNorm(), 1e-7);
}

}  // namespace
}  // namespace armcal::math
