// calibration - computes several dot products at a time, over so few rows that they stay in the nearest caches.
#include "host_sim/identify/calibration/tall_product.hpp"

#include <algorithm>

#include "codegen/src/generator/vector_units.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

using codegen::kLanes, codegen::Lanes, codegen::LanesAt;
constexpr Index kNear = 512;  // rows
constexpr int kWide = 4, kHigh = 2;

struct Columns {
  const double* first;
  Index stride;
  const double* operator[](Index i) const { return first + i * stride; }
};

// out[m + n * ld] += a[m]' b[n] over the rows.
template <int M, int N>
inline __attribute__((always_inline)) void Dots(Columns a, Columns b, Index rows, double* out, Index ld) {
  Lanes sum[M][N] = {};
  Index r = 0;
  for (; r + kLanes <= rows; r += kLanes)
#pragma GCC unroll 2
    for (int n = 0; n < N; ++n) {
      const Lanes right = LanesAt(b[n] + r);
#pragma GCC unroll 4
      for (int m = 0; m < M; ++m) sum[m][n] += LanesAt(a[m] + r) * right;
    }
#pragma GCC unroll 2
  for (int n = 0; n < N; ++n)
#pragma GCC unroll 4
    for (int m = 0; m < M; ++m) {
      double rest = 0;
      for (Index k = r; k < rows; ++k) rest += a[m][k] * b[n][k];
      for (int l = 0; l < kLanes; ++l) rest += sum[m][n][l];
      out[m + n * ld] += rest;
    }
}

// Columns [0, left) of a by all of b.
ARMCAL_VECTOR_UNITS("avx2")
void AddDots(Columns a, Index left, Columns b, Index right, Index rows, double* out, Index ld) {
  for (Index n = 0; n < right;) {
    const Index high = n + kHigh <= right ? kHigh : 1;
    for (Index m = 0; m < left;) {
      const Index wide = m + kWide <= left ? kWide : 1;
      const Columns some{a[m], a.stride}, others{b[n], b.stride};
      double* const at = out + m + n * ld;
      if (wide == kWide && high == kHigh) Dots<kWide, kHigh>(some, others, rows, at, ld);
      else if (wide == kWide) Dots<kWide, 1>(some, others, rows, at, ld);
      else if (high == kHigh) Dots<1, kHigh>(some, others, rows, at, ld);
      else Dots<1, 1>(some, others, rows, at, ld);
      m += wide;
    }
    n += high;
  }
}

Columns From(const Tall& m, Index row, Index column = 0) {
  return {m.data() + row + column * m.outerStride(), m.outerStride()};
}

}  // namespace

MatrixXd TallProduct(const Tall& a, const Tall& b) {
  MatrixXd out = MatrixXd::Zero(a.cols(), b.cols());
  for (Index row = 0; row < a.rows(); row += kNear)
    AddDots(From(a, row), a.cols(), From(b, row), b.cols(), std::min(kNear, a.rows() - row), out.data(), a.cols());
  return out;
}

MatrixXd SelfProduct(const Tall& m) {
  constexpr Index kBand = 8;  // columns: of the upper triangle and a little below it
  MatrixXd out = MatrixXd::Zero(m.cols(), m.cols());
  for (Index row = 0; row < m.rows(); row += kNear)
    for (Index c = 0; c < m.cols(); c += kBand) {
      const Index wide = std::min(kBand, m.cols() - c);
      AddDots(From(m, row), c + wide, From(m, row, c), wide, std::min(kNear, m.rows() - row), out.col(c).data(),
              m.cols());
    }
  out.triangularView<Eigen::StrictlyLower>() = out.transpose();
  return out;
}

}  // namespace armcal::calibration
