// physical - what a read-out is asked: a filter's result in prior units, and the table it started from; what the data
// alone said. Knows no filter.
#pragma once

#include "armcal/core/status.hpp"
#include "armcal/math/ud.hpp"
#include "armcal/physical/physical.hpp"

namespace armcal::physical {

// Layout: the constants of a generated model (model/contract.hpp). Columns are [front, rigid, dense effects]; prior
// units: x_k = (b_k - b0_k) / s_k.
template <class Layout>
struct MapPrior {
  const float* body;      // [kBodyParameters] table's means, 11 a link: ten about the link origin, rotor inertia
  const float* body_sd;   // [kBodyParameters] of m, c, I about the centre, rotor; 0: held
  const float* column;    // [kColumns] b0
  const float* scale;     // [kColumns] s; 0: held
  const float* dense_ud;  // [UdSize(kDense)] the filter's prior of the dense columns, in prior units
};

// Mean and covariance U D U' after the data, prior inside, whichever filter it comes from.
template <class Layout>
struct Posterior {
  const float* x;   // [kColumns]
  const float* ud;  // [UdSize(kColumns)]
};

// v [n] = b U^-1 for the unit upper triangle of the n columns from `offset` on, in place; b is zero before `first`.
template <int n, class T>
void SolveRow(const float* ud, int offset, int first, T* v) {
  for (int i = first + 1; i < n; ++i) {
    const float* column = ud + math::UdIndex(offset, offset + i);
    for (int k = first; k < i; ++k) v[i] -= v[k] * T(column[k]);
  }
}

// Row [kDense] of dense columns in prior units -> row [kBodyParameters + dense effects] of bodies about the link
// origins: b = B body.
template <class Layout, class T>
void RowOfBodies(const float* scale, const T* row, T* out) {
  for (int k = 0; k < Layout::kBodyParameters; ++k) out[k] = T(0);
  for (int r = 0; r < Layout::kRigid; ++r) {
    const T value = math::Divide(row[r], T(scale[Layout::kFront + r]));
    for (int e = Layout::kMapBegin[r]; e < Layout::kMapBegin[r + 1]; ++e)
      out[Layout::kMapColumn[e]] += value * T(Layout::kMapValue[e]);
  }
  for (int k = Layout::kRigid; k < Layout::kDense; ++k) out[Layout::kBodyParameters + k - Layout::kRigid] = row[k];
}

// What the data alone say of y = [bodies about the link origins - their means, dense effects in prior units], all
// friction left free: minus log likelihood = y' information y / 2 + gradient' y. The filter's covariance, less the
// prior that it holds: P^-1 - C^-1 = U^-T D^-1 U^-1 - (that of the prior). Front columns are left out of P by leaving
// them out of its factor's end.
template <class Layout, class T>
class DataInformation {
 public:
  static constexpr int kFree = Layout::kBodyParameters + Layout::kDense - Layout::kRigid;
  static constexpr int kRows = Layout::kDense + Layout::kRigid;  // calls of AddRow

  void Clear() {
    for (T& a : packed_) a = T(0);
  }
  // One row of the filter's U^-1, or of the prior's. gradient [kFree]: gets the row's part.
  void AddRow(int k, const MapPrior<Layout>& prior, const Posterior<Layout>& posterior, T* gradient) {
    const bool from_filter = k < Layout::kDense;
    const int row = from_filter ? k : k - Layout::kDense, offset = from_filter ? Layout::kFront : 0;
    const float* ud = from_filter ? posterior.ud : prior.dense_ud;
    T v[Layout::kDense] = {}, a[kFree], at = T(0);
    v[row] = T(1);
    if (from_filter) SolveRow<Layout::kDense>(ud, offset, row, v);
    else SolveRow<Layout::kRigid>(ud, offset, row, v);
    for (int i = 0; i < Layout::kDense; ++i) at += v[i] * T(posterior.x[Layout::kFront + i]);
    RowOfBodies<Layout>(prior.scale, v, a);
    const T weight = math::Divide(T(from_filter ? 1 : -1), T(ud[math::UdIndex(offset + row, offset + row)]));
    T* packed = packed_;
    for (int j = 0; j < kFree; ++j) {
      const T scaled = weight * a[j];
      for (int i = 0; i <= j; ++i) *packed++ += scaled * a[i];
      if (from_filter) gradient[j] -= scaled * at;
    }
  }
  T at(int i, int j) const { return packed_[i < j ? math::UdIndex(i, j) : math::UdIndex(j, i)]; }
  // Row i of the information times y [kFree].
  T Times(int i, const T* y) const {
    T sum = T(0);
    for (int j = 0; j < kFree; ++j) sum += at(i, j) * y[j];
    return sum;
  }

 private:
  T packed_[math::UdSize(kFree)] = {};
};

// kUnphysical: a body of the prior cannot exist. kNotFinite: a number of the result is none, or a D is negative.
template <class Layout>
core::Status Judge(const MapPrior<Layout>& prior, const Posterior<Layout>& posterior) {
  constexpr int kBlock = Layout::kBodyParameters / Layout::kJoints;
  for (int link = 0; link < Layout::kJoints; ++link)
    if (!IsPhysical(prior.body + link * kBlock)) return core::Status::kUnphysical;
  bool finite = true;
  for (int k = 0; k < Layout::kColumns; ++k)
    finite &= math::IsFinite(posterior.x[k]) && posterior.ud[math::UdIndex(k, k)] >= 0.0f;
  for (int k = 0; k < math::UdSize(Layout::kColumns); ++k) finite &= math::IsFinite(posterior.ud[k]);
  return finite ? core::Status::kOk : core::Status::kNotFinite;
}

}  // namespace armcal::physical
