// diagnosis - averages over a curve's coefficients.
#include "host_sim/diagnose/diagnosis/curve_odds.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <unsupported/Eigen/KroneckerProduct>

namespace armcal::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kOfTheirOwn = 0.1, kAlike = 1.5;  // lengths, in knots
constexpr double kUnseen = 1e-9;                   // of the largest
constexpr int kSizes = 34;                         // squares, each twice the one before
constexpr int kSteps = 20;                         // of a product's two curves in turn
constexpr double kEnds = 1e-4;                     // of a curve's norm: a step this small ends the search
constexpr double kBesideProduct = 1e-4;            // of the variance that a product's own coefficients have

// How much alike `count` knots in a row are.
MatrixXd Alike(int count, double length) {
  MatrixXd out(count, count);
  for (int i = 0; i < count; ++i)
    for (int m = 0; m < count; ++m) out(i, m) = std::exp(-0.5 * std::pow((i - m) / length, 2)) + 1e-4 * (i == m);
  return out;
}

}  // namespace

// Coefficients u x v: the outer curve's by the inner one's, each of unit prior. S and g are in units of the noise.
struct CurveOdds::Product {
  const MatrixXd& S;
  const VectorXd& g;
  VectorXd u, v;

  // Sums over one direction: of S's columns, then of rows.
  MatrixXd ColumnsByU() const {  // [mn x n]
    MatrixXd out = MatrixXd::Zero(S.rows(), v.size());
    for (Index o = 0; o < u.size(); ++o) out += u[o] * S.middleCols(o * v.size(), v.size());
    return out;
  }
  MatrixXd ColumnsByV() const {  // [mn x m]
    MatrixXd out(S.rows(), u.size());
    for (Index o = 0; o < u.size(); ++o) out.col(o) = S.middleCols(o * v.size(), v.size()) * v;
    return out;
  }
  MatrixXd RowsByU(const MatrixXd& from) const {
    MatrixXd out = MatrixXd::Zero(v.size(), from.cols());
    for (Index o = 0; o < u.size(); ++o) out += u[o] * from.middleRows(o * v.size(), v.size());
    return out;
  }
  MatrixXd RowsByV(const MatrixXd& from) const {
    MatrixXd out(u.size(), from.cols());
    for (Index o = 0; o < u.size(); ++o) out.row(o) = v.transpose() * from.middleRows(o * v.size(), v.size());
    return out;
  }
  auto table(const VectorXd& x) const { return MatrixXd::Map(x.data(), v.size(), u.size()); }

  void Climb() {
    const auto best = [](MatrixXd H, const VectorXd& right) -> VectorXd {
      H.diagonal().array() += 1;
      return Eigen::LLT<MatrixXd>(H).solve(right);
    };
    for (int step = 0; step < kSteps; ++step) {
      const VectorXd before = u;
      v = best(RowsByU(ColumnsByU()), table(g) * u);
      u = best(RowsByV(ColumnsByV()), table(g).transpose() * v);
      const double norm = std::sqrt(u.norm() * v.norm());  // the prior likes both alike
      if (!(norm > 0)) return;
      u *= norm / u.norm(), v *= norm / v.norm();
      if ((u - before).norm() < kEnds * norm) return;
    }
  }

  // Twice the log evidence by a normal form about the best coefficients (Laplace).
  double Evidence() const {
    const VectorXd c = Eigen::kroneckerProduct(u, v), left = g - S * c;
    const Index m = u.size(), n = v.size();
    const MatrixXd by_u = ColumnsByU();
    MatrixXd H = MatrixXd::Identity(m + n, m + n);
    H.topLeftCorner(m, m) += RowsByV(ColumnsByV());
    H.bottomRightCorner(n, n) += RowsByU(by_u);
    H.topRightCorner(m, n) = RowsByV(by_u) - table(left).transpose();
    H.bottomLeftCorner(n, m) = H.topRightCorner(m, n).transpose();
    const Eigen::LLT<MatrixXd> factor(H);
    if (factor.info() != Eigen::Success) return 0;
    const double logdet = 2 * factor.matrixLLT().diagonal().array().log().sum();
    return g.dot(c) + left.dot(c) - u.squaredNorm() - v.squaredNorm() - logdet;
  }

  // Of the coefficients near the best ones.
  MatrixXd Covariance() const {
    MatrixXd out = Eigen::kroneckerProduct(MatrixXd::Identity(u.size(), u.size()), v * v.transpose());
    out += Eigen::kroneckerProduct(u * u.transpose(), MatrixXd::Identity(v.size(), v.size()));
    out.diagonal().array() += kBesideProduct * out.diagonal().maxCoeff();
    return out;
  }
};

CurveOdds::CurveOdds(const MatrixXd& S, const VectorXd& g, int inner)
    : inner_(inner), outer_(static_cast<int>(g.size()) / inner) {
  for (const double length : {kOfTheirOwn, kAlike}) {
    MatrixXd alike = Alike(inner, length);
    if (outer_ > 1) alike = Eigen::kroneckerProduct(Alike(outer_, length), alike).eval();
    const Eigen::LLT<MatrixXd> factor(alike);
    const MatrixXd root = factor.matrixL();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(root.transpose() * S * root));
    const VectorXd u = eigen.eigenvectors().transpose() * (root.transpose() * g);
    priors_.push_back(
        {factor.solve(MatrixXd::Identity(g.size(), g.size())), eigen.eigenvalues().cwiseMax(0), u.cwiseAbs2()});
  }
  if (outer_ > 1) FormProducts(S, g);
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
  if (outer_ > 1 && best < gain) TryProducts(share, best, precision);
  return best;
}

void CurveOdds::FormProducts(const MatrixXd& S, const VectorXd& g) {
  // A search begins at the product that is nearest to the coefficients of a weak prior.
  MatrixXd H = S;
  H.diagonal().array() += H.trace() / static_cast<double>(g.size());
  const VectorXd c = Eigen::LLT<MatrixXd>(H).solve(g);
  const auto table = MatrixXd::Map(c.data(), inner_, outer_);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(table.transpose() * table));
  const VectorXd outer = eigen.eigenvectors().rightCols(1), inner = table * outer;
  const double norm = inner.norm();
  if (!(norm > 0)) return;
  for (const double length_u : {kOfTheirOwn, kAlike})
    for (const double length_v : {kOfTheirOwn, kAlike}) {
      const MatrixXd Bu = Eigen::LLT<MatrixXd>(Alike(outer_, length_u)).matrixL(),
                     Bv = Eigen::LLT<MatrixXd>(Alike(inner_, length_v)).matrixL();
      Form form{Eigen::kroneckerProduct(Bu, Bv), {}, {}, {}, {}};
      form.S = form.root.transpose() * S * form.root;
      form.g = form.root.transpose() * g;
      form.u = Bu.triangularView<Eigen::Lower>().solve(std::sqrt(norm) * outer);
      form.v = Bv.triangularView<Eigen::Lower>().solve(inner / std::sqrt(norm));
      forms_.push_back(std::move(form));
    }
}

void CurveOdds::TryProducts(double share, double& best, MatrixXd* precision) const {
  for (const Form& form : forms_) {
    const double largest = share * form.S.diagonal().maxCoeff();
    double most = 0;  // of this form
    for (int doubled = 0; doubled < kSizes; doubled += 2) {
      const double size2 = std::ldexp(0.1 / largest, doubled), part = std::pow(size2, -0.25);  // of the two curves
      const MatrixXd S = share * size2 * form.S;
      const VectorXd g = share * std::sqrt(size2) * form.g;
      Product product{S, g, part * form.u, part * form.v};
      product.Climb();
      const double evidence = product.Evidence();
      if (evidence < most) break;
      most = evidence;
      if (!(evidence > best)) continue;
      best = evidence;
      if (precision) *precision = (size2 * form.root * product.Covariance() * form.root.transpose()).inverse();
    }
  }
}

}  // namespace armcal::diagnosis
