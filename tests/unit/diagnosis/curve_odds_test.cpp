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
    MatrixXd precision;
    const double evidence = rows.Odds(8).Evidence(rows.Gain(), &precision);
    EXPECT_NEAR(evidence, best, 0.02 * best + 0.05) << size;
    if (evidence > 0) {
      EXPECT_NEAR(rows.Likelihood(precision.inverse()), evidence, 1e-3 * evidence) << size;
    }
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
