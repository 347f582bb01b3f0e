// logs - solves for the coefficients of a B-spline with a banded factorisation.
#include "host_sim/data/logs/quintic_spline.hpp"

#include <algorithm>
#include <array>

#include "codegen/src/io/input_error.hpp"

namespace armcal::logs {
namespace {

using Eigen::Index;
constexpr Index kDegree = 5;

// The degree + 1 B-splines that are not zero in [knot[span], knot[span + 1]), at x (Cox and de Boor).
std::array<double, kDegree + 1> Basis(const Eigen::VectorXd& knot, Index span, Index degree, double x) {
  std::array<double, kDegree + 1> basis{1};
  for (Index d = 1; d <= degree; ++d) {
    double carry = 0;
    for (Index r = 0; r < d; ++r) {
      const double right = knot[span + r + 1];
      const double left = knot[span + r + 1 - d];
      const double share = basis[static_cast<std::size_t>(r)] / (right - left);
      basis[static_cast<std::size_t>(r)] = carry + (right - x) * share;
      carry = (x - left) * share;
    }
    basis[static_cast<std::size_t>(d)] = carry;
  }
  return basis;
}

// The span that holds x, found by walking on from the last one.
Index Span(const Eigen::VectorXd& knot, Index span, double x) {
  while (span + 1 < knot.size() - kDegree - 1 && x >= knot[span + 1]) ++span;
  return span;
}

// Solves A w = y for a band matrix with kBand diagonals on each side. B-spline collocation is totally positive, so
// elimination without pivoting is stable (de Boor, A Practical Guide to Splines, ch. XIII).
class BandSystem {
 public:
  static constexpr Index kBand = 4;

  explicit BandSystem(Index n) : rows_(Eigen::MatrixXd::Zero(2 * kBand + 1, n)) {}

  double& At(Index row, Index column) { return rows_(column - row + kBand, row); }

  void Solve(Eigen::MatrixXd& y) {
    const Index n = rows_.cols();
    for (Index k = 0; k < n; ++k) {
      const Index last = std::min(n - 1, k + kBand);
      for (Index i = k + 1; i <= last; ++i) {
        const double factor = At(i, k) / At(k, k);
        if (factor == 0) continue;
        for (Index j = k + 1; j <= last; ++j) At(i, j) -= factor * At(k, j);
        y.row(i) -= factor * y.row(k);
      }
    }
    for (Index k = n - 1; k >= 0; --k) {
      for (Index j = k + 1; j <= std::min(n - 1, k + kBand); ++j) y.row(k) -= At(k, j) * y.row(j);
      y.row(k) /= At(k, k);
    }
  }

 private:
  Eigen::MatrixXd rows_;  // one column a row of A, so that a row lies together in memory
};

}  // namespace

QuinticSpline::QuinticSpline(const Eigen::VectorXd& t, const Eigen::MatrixXd& y) {
  const Index n = t.size();
  if (n < kMinSamples) throw io::InputError("a spline needs at least " + std::to_string(kMinSamples) + " samples");
  knot_.resize(n + kDegree + 1);
  knot_.head(kDegree + 1).setConstant(t[0]);
  knot_.segment(kDegree + 1, n - kDegree - 1) = t.segment(3, n - kDegree - 1);
  knot_.tail(kDegree + 1).setConstant(t[n - 1]);

  BandSystem system(n);
  Index span = kDegree;
  for (Index k = 0; k < n; ++k) {
    span = Span(knot_, span, t[k]);
    const auto basis = Basis(knot_, span, kDegree, t[k]);
    for (Index r = 0; r <= kDegree; ++r) {
      const Index column = span - kDegree + r;
      const double value = basis[static_cast<std::size_t>(r)];
      if (value != 0) system.At(k, column) = value;
    }
  }
  weight_[0] = y;
  system.Solve(weight_[0]);

  // d/dx of a spline of degree d with weights w has weights d (w[j] - w[j-1]) / (knot[j+d] - knot[j]), degree d - 1.
  for (Index order = 1; order <= 2; ++order) {
    const Index degree = kDegree + 1 - order;
    const Eigen::MatrixXd& from = weight_[order - 1];
    Eigen::MatrixXd& to = weight_[order];
    to.resize(n - order, y.cols());
    for (Index j = 0; j < n - order; ++j) {
      const double width = knot_[j + order + degree] - knot_[j + order];
      to.row(j) = static_cast<double>(degree) / width * (from.row(j + 1) - from.row(j));
    }
  }
}

Eigen::MatrixXd QuinticSpline::Evaluate(const Eigen::VectorXd& at, int order) const {
  const Eigen::MatrixXd& weight = weight_[order];
  const Index degree = kDegree - order;
  Eigen::MatrixXd value = Eigen::MatrixXd::Zero(at.size(), weight.cols());
  Index span = kDegree;
  for (Index k = 0; k < at.size(); ++k) {
    span = Span(knot_, span, at[k]);
    const auto basis = Basis(knot_, span, degree, at[k]);
    for (Index r = 0; r <= degree; ++r) {
      value.row(k) += basis[static_cast<std::size_t>(r)] * weight.row(span - kDegree + r);
    }
  }
  return value;
}

}  // namespace armcal::logs
