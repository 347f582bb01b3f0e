// filter - where a filter starts and what each column may do; knows columns, not what they mean.
//
// Prior units: x_k = (b_k - b0_k) / s_k with s_k^2 the prior variance of column k, so that every active column starts
// with mean 0 and variance 1. Rows are whitened: y = (tau - Y b0) / sigma, h_k = Y_k s_k / sigma, noise variance 1.
// Front columns are independent of all others in the prior; dense columns are correlated.
//
// Layout is a struct of constants (a generated model is one): kJoints, kFront, kFrontBegin[kJoints + 1], kDense,
// kRowBegin[kJoints], kColumns = kFront + kDense, kNonlinear. See model/contract.hpp. The nonlinear parameters eta are
// columns of the extended filter alone, numbered from kColumns on, independent of all others in the prior.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/filter/order.hpp"
#include "armcal/math/ud.hpp"

namespace armcal::filter {

inline constexpr float kRowLimit = 1e6f;  // a larger element of a row means a broken model: float32 would overflow

template <class Layout>
struct Prior {
  static constexpr int kStates = Layout::kColumns + Layout::kNonlinear;
  float dense_ud[math::UdSize(Layout::kDense)] = {};  // correlation of the dense columns as U D U'
  std::uint32_t active[kStates] = {};                 // all ones: the column has uncertainty; 0: fixed or standby
  bool considered[kStates] = {};                      // counted, not updated (Kalman form)
  bool any_considered = false;
  float lambda[kStates] = {};  // forgetting per sample, in (0, 1] (forgetting form)
  float noise[kStates] = {};   // variance per sample, prior units (Kalman form)
  float link_floor = 0.0f;     // D of dense columns never falls below (Kalman form)
  float gate_sigma = 0.0f;     // innovations beyond are not used; 0: no gate (Kalman form)
};

// What one row did. Whitened units.
struct UpdateReport {
  float innovation = 0.0f;  // row minus its prediction by this filter before the row; 0 unless the row was judged
  float variance = 1.0f;    // its variance by this filter (forgetting form: from data alone, without the prior)
  bool accepted = false;
  core::Status status = core::Status::kGated;  // kOk, kGated, kNotFinite, kOutOfRange (element beyond kRowLimit)
};

// Joint of a front column, and the mask of joints that must move before a column may change by itself:
// a front column needs its own joint, a dense column all of them.
template <class Layout>
constexpr std::uint32_t JointsOf(int column) {
  for (int i = 0; i < Layout::kJoints; ++i)
    if (column < Layout::kFrontBegin[i + 1]) return 1u << i;
  return (1u << Layout::kJoints) - 1u;
}

// x = 0 and the prior's correlation, in any order of the columns. Slopes start as known: zero. Context: background.
template <class Layout, class Estimate>
void SetPrior(const Prior<Layout>& prior, Estimate& estimate) {
  using Columns = typename Estimate::Columns;
  const auto& at = Columns::kAt.position;
  estimate.Clear();
  for (int k = 0; k < Layout::kFront; ++k) estimate.d(at[k]) = math::Masked(1.0f, prior.active[k]);
  for (int j = 0; j < Layout::kDense; ++j) {
    const int p = at[Layout::kFront + j];
    for (int i = 0; i < j; ++i) estimate.u(at[Layout::kFront + i], p) = prior.dense_ud[math::UdIndex(i, j)];
    estimate.d(p) = prior.dense_ud[math::UdIndex(j, j)];
  }
  if constexpr (Columns::kBeside == Beside::kEta)
    for (int k = Layout::kColumns; k < Columns::kSize; ++k) estimate.d(at[k]) = math::Masked(1.0f, prior.active[k]);
}

// A row is judged by its largest element in magnitude: kOk, kNotFinite or kOutOfRange. Context: background.
inline std::uint32_t MagnitudeBits(float x) { return math::BitsOf(x) & 0x7FFFFFFFu; }
inline core::Status Judge(std::uint32_t largest_magnitude_bits) {
  if (largest_magnitude_bits >= 0x7F800000u) return core::Status::kNotFinite;
  return largest_magnitude_bits > math::BitsOf(kRowLimit) ? core::Status::kOutOfRange : core::Status::kOk;
}

}  // namespace armcal::filter
