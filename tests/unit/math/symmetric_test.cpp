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

// Rows and columns together must be one after the other to the bit, at every length of the remainder.
template <int rows, int columns, class Random>
void CompareBlocks(Random random) {
  constexpr int kLength = 12, kPairs = rows * columns;
  for (int length = 0; length <= kLength; ++length) {
    const Matrix u = Matrix::NullaryExpr(kLength, columns, random);
    const Matrix x = Matrix::NullaryExpr(rows, kLength, random);  // an element of each row side by side
    const Matrix step = Matrix::NullaryExpr(2, kPairs, random);
    Matrix expected_u = u, expected_x = x, got_u = u, got_x = x, sum = Matrix::Constant(rows, columns, 0.5);
    double* column[columns];
    for (int j = 0; j < columns; ++j) column[j] = got_u.col(j).data();
    Dots<rows, columns>(x.data(), column, length, sum.data());
    BiermanBlock<rows, columns>(got_x.data(), column, step.data(), length);
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const double v = step(0, j * rows + i), shift = step(1, j * rows + i);
        for (int k = 0; k < length; ++k) {
          const double before = expected_u(k, j);
          expected_u(k, j) += expected_x(i, k) * shift;
          expected_x(i, k) += before * v;
        }
        EXPECT_NEAR(sum(i, j), 0.5 + u.col(j).head(length).dot(x.row(i).head(length)), 1e-14);
      }
    EXPECT_TRUE(got_u == expected_u && got_x == expected_x) << rows << " x " << columns << ", " << length;
  }
}

TEST_F(Ud, BlocksOfRowsAndColumns_GiveTheBitsOfOneByOne) {
  const auto next = [&] { return normal(random); };
  CompareBlocks<1, 1>(next);
  CompareBlocks<2, 1>(next);
  CompareBlocks<2, 4>(next);
  CompareBlocks<3, 4>(next);
}

TEST_F(Ud, FoldedColumns_GiveTheBitsOfOneByOne) {
  for (int length = 0; length < 12; ++length) {
    const Matrix r = Matrix::NullaryExpr(12, 4, [&] { return normal(random); });
    const Matrix fold = Matrix::NullaryExpr(2, 4, [&] { return normal(random); });
    Matrix expected_r = r, got_r = r;
    Vector expected_x = Random(12), got_x = expected_x;
    double* column[4];
    for (int j = 0; j < 4; ++j) {
      column[j] = got_r.col(j).data();
      Fold(expected_x.data(), expected_r.col(j).data(), fold(0, j), fold(1, j), length);
    }
    FoldColumns<4>(got_x.data(), column, fold.data(), length);
    EXPECT_TRUE(got_r == expected_r && got_x == expected_x) << length;
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
