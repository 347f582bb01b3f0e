// diagnosis - averages over a curve's coefficients.
#include "host_sim/diagnose/diagnosis/curve_odds.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <unsupported/Eigen/KroneckerProduct>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kOfTheirOwn = 0.1, kAlike = 1.5;  // lengths, in knots
constexpr double kUnseen = 1e-9;                   // of the largest
constexpr int kSizes = 34;                         // squares, each twice the one before

// How much alike `count` knots in a row are.
MatrixXd Alike(int count, double length) {
  MatrixXd out(count, count);
  for (int i = 0; i < count; ++i)
    for (int m = 0; m < count; ++m) out(i, m) = std::exp(-0.5 * std::pow((i - m) / length, 2)) + 1e-4 * (i == m);
  return out;
}

}  // namespace

CurveOdds::CurveOdds(const MatrixXd& S, const VectorXd& g, int inner) {
  const int outer = static_cast<int>(g.size()) / inner;
  for (const double length : {kOfTheirOwn, kAlike}) {
    MatrixXd alike = Alike(inner, length);
    if (outer > 1) alike = Eigen::kroneckerProduct(Alike(outer, length), alike).eval();
    const Eigen::LLT<MatrixXd> factor(alike);
    const MatrixXd root = factor.matrixL();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(root.transpose() * S * root));
    const VectorXd u = eigen.eigenvectors().transpose() * (root.transpose() * g);
    priors_.push_back({factor.solve(MatrixXd(MatrixXd::Identity(g.size(), g.size()))), eigen.eigenvalues().cwiseMax(0),
                       u.cwiseAbs2()});
  }
  const Prior& any = priors_[0];
  for (Eigen::Index i = 0; i < any.seen.size(); ++i)
    if (any.seen[i] > kUnseen * any.seen.maxCoeff()) free_gain_ += any.u2[i] / any.seen[i];
}

double CurveOdds::Evidence(double gain, MatrixXd* precision) const {
  double best = 0;
  if (free_gain_ <= 0) return best;
  const double share = gain / free_gain_;  // of the noise's inverse variance
  for (const Prior& prior : priors_) {
    const double largest = share * prior.seen.maxCoeff();
    if (largest <= 0) continue;
    for (int doubled = 0; doubled < kSizes; ++doubled) {
      const double size2 = std::ldexp(0.1 / largest, doubled);
      const Eigen::ArrayXd seen = share * size2 * prior.seen.array();
      const double evidence = (share * share * size2 * prior.u2.array() / (1 + seen) - seen.log1p()).sum();
      if (evidence <= best) continue;
      best = evidence;
      if (precision) *precision = prior.precision / size2;
    }
  }
  return best;
}

}  // namespace armcal::diagnosis
