// diagnosis tests - compares the evidence of a curve with the likelihood of its rows, from dense normal distributions.
#include "host_sim/diagnose/diagnosis/curve_odds.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

namespace armcal::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Rows y = C a + e, e of deviation one.
struct CurveRows {
  CurveRows(int rows, int columns, double size) : C(rows, columns), y(rows) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (double& c : C.reshaped()) c = normal(random);
    VectorXd a(columns);
    for (int k = 0; k < columns; ++k) a[k] = size * std::sin(0.6 * k);
    for (double& e : y) e = normal(random);
    y += C * a;
  }
  CurveOdds Odds(int inner) const { return {C.transpose() * C, C.transpose() * y, inner}; }
  double Gain() const { return (C.transpose() * y).dot((C.transpose() * C).ldlt().solve(C.transpose() * y)); }
  // 2 ln of the likelihood with coefficients of this covariance, over that without any.
  double Likelihood(const MatrixXd& covariance) const {
    const MatrixXd S = MatrixXd::Identity(y.size(), y.size()) + C * covariance * C.transpose();
    return y.squaredNorm() - y.dot(S.ldlt().solve(y)) - std::log(S.determinant());
  }
  MatrixXd C;
  VectorXd y;
};

// Neighbours k knots apart are alike by exp(-k^2 / (2 length^2)).
MatrixXd Alike(int count, double length) {
  MatrixXd out = 1e-4 * MatrixXd::Identity(count, count);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < count; ++k) out(i, k) += std::exp(-(i - k) * (i - k) / (2 * length * length));
  return out;
}

double BestLikelihood(const CurveRows& rows, const std::vector<MatrixXd>& alike, double step = 0.1) {
  double best = 0;
  for (const MatrixXd& a : alike)
    for (double log_size = -12; log_size < 8; log_size += step)
      best = std::max(best, rows.Likelihood(std::exp(log_size) * a));
  return best;
}

TEST(CurveOdds, AreTheLikelihoodOfTheRows) {
  for (const double size : {0.05, 0.3, 2.0}) {
    const CurveRows rows(60, 8, size);
    const double best = BestLikelihood(rows, {Alike(8, 0.1), Alike(8, 1.5)});
    EXPECT_NEAR(rows.Odds(8).Evidence(rows.Gain()), best, 0.02 * best + 0.05) << size;
  }
}

// The same coefficients, row by row or column by column: a surface has no first direction.
TEST(CurveOdds, OfASurface_DoNotDependOnTheOrderOfItsDirections) {
  CurveRows rows(120, 36, 0.2);
  VectorXd a(36);
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) a[6 * i + k] = 0.4 * std::sin(0.5 * i) * std::cos(0.3 * k);
  rows.y += rows.C * a;
  CurveRows turned = rows;
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) turned.C.col(6 * k + i) = rows.C.col(6 * i + k);
  const double evidence = rows.Odds(6).Evidence(rows.Gain());
  EXPECT_GT(evidence, 0);
  EXPECT_NEAR(evidence, turned.Odds(6).Evidence(turned.Gain()), 1e-6 * evidence);
}

// A smooth surface needs less freedom than its 36 coefficients.
TEST(CurveOdds, OfASmoothSurface_AreNearlyItsGain) {
  CurveRows rows(400, 36, 0);
  VectorXd a(36);
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) a[6 * i + k] = 0.1 * (i - 2.5) * (k - 2.5);
  rows.y += rows.C * a;
  EXPECT_GT(rows.Odds(6).Evidence(rows.Gain()), rows.Odds(36).Evidence(rows.Gain()) + 10);
}

// The likelihood of u x v with unit normal curves: over v a normal form, over u a sum on a grid.
double ProductLikelihood(const CurveRows& rows, double size, double length_u, double length_v) {
  const Eigen::Index wide = rows.C.cols() / 2;
  const MatrixXd Bu = Alike(2, length_u).llt().matrixL(), Bv = Alike(static_cast<int>(wide), length_v).llt().matrixL(),
                 C = std::sqrt(size) * rows.C;
  constexpr double kReach = 5, kStep = 0.1;
  double sum = 0;
  for (double a = -kReach; a < kReach; a += kStep)
    for (double b = -kReach; b < kReach; b += kStep) {
      const VectorXd u = Bu * Eigen::Vector2d(a, b);
      const MatrixXd D = (u[0] * C.leftCols(wide) + u[1] * C.rightCols(wide)) * Bv;
      const MatrixXd M = D.transpose() * D + MatrixXd::Identity(wide, wide);
      const VectorXd h = D.transpose() * rows.y;
      sum += std::exp(0.5 * h.dot(M.ldlt().solve(h)) - 0.5 * (a * a + b * b)) / std::sqrt(M.determinant());
    }
  return 2 * std::log(sum * kStep * kStep / (2 * std::acos(-1.0)));
}

TEST(CurveOdds, OfAProduct_AreTheLikelihoodOfTheRows) {
  CurveRows rows(60, 12, 0);
  VectorXd a(12);
  for (int k = 0; k < 6; ++k) a[k] = 0.6 * std::sin(2 * k), a[6 + k] = -0.8 * a[k];
  rows.y += rows.C * a;
  double best = 0;
  for (double log_size = -4; log_size < 3; log_size += 0.7) {
    best = std::max(best, ProductLikelihood(rows, std::exp(log_size), 0.1, 0.1));
    best = std::max(best, ProductLikelihood(rows, std::exp(log_size), 1.5, 0.1));
  }
  ASSERT_GT(best, BestLikelihood(rows, {Alike(12, 0.1)}) + 2);
  // The likelihood has two like peaks, at (u, v) and (-u, -v), and each is longer than a normal form: 3 of 115.
  EXPECT_NEAR(rows.Odds(6).Evidence(rows.Gain()), best - 1.5, 1.5);
}

// Bumps along one direction times a wave along the other: 11 numbers instead of 36.
TEST(CurveOdds, OfAProductWithBumps_AreNearlyItsGain) {
  CurveRows rows(400, 36, 0);
  VectorXd a(36);
  const double bumps[] = {0, 0.3, -0.3, 0, 0.4, 0.1};
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) a[6 * i + k] = bumps[i] * std::sin(1.1 * k);
  rows.y += rows.C * a;
  const double evidence = rows.Odds(6).Evidence(rows.Gain());
  EXPECT_GT(evidence, BestLikelihood(rows, {Alike(36, 0.1)}, 0.5) + 15);
  // A surface that is no product gains nothing by this.
  CurveRows other(400, 36, 0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (double& x : a) x = 0.3 * normal(random);
  other.y += other.C * a;
  const double plain = BestLikelihood(other, {Alike(36, 0.1)}, 0.5);
  EXPECT_NEAR(other.Odds(6).Evidence(other.Gain()), plain, 0.01 * plain);
}

// Noise that is larger by a factor makes every product, and with it the gain, smaller by its square.
TEST(CurveOdds, WithASmallerGain_AreThoseOfNoisierRows) {
  const CurveRows rows(60, 8, 0.5);
  CurveRows noisier = rows;
  noisier.C /= 2, noisier.y /= 2;
  MatrixXd precision, direct;
  EXPECT_NEAR(rows.Odds(8).Evidence(rows.Gain() / 4, &precision), noisier.Odds(8).Evidence(noisier.Gain(), &direct),
              1e-9);
  EXPECT_LT((precision - direct).cwiseAbs().maxCoeff(), 1e-6 * direct.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace armcal::diagnosis
