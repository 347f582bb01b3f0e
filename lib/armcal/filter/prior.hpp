// filter - where a filter starts and what each column may do; knows columns, not what they mean.
//
// Prior units: x_k = (b_k - b0_k) / s_k with s_k^2 the prior variance of column k, so that every active column starts
// with mean 0 and variance 1. Rows are whitened: y = (tau - Y b0) / sigma, h_k = Y_k s_k / sigma, noise variance 1.
// Front columns are independent of all others in the prior; dense columns are correlated.
//
// Layout is a struct of constants (a generated model is one): kJoints, kFront, kFrontBegin[kJoints + 1], kDense,
// kRowBegin[kJoints], kColumns = kFront + kDense. See model/contract.hpp.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/math/ud.hpp"

namespace armcal::filter {

inline constexpr float kRowLimit = 1e6f;  // a larger element of a row means a broken model: float32 would overflow

template <class Layout>
struct Prior {
  float dense_ud[math::UdSize(Layout::kDense)] = {};  // correlation of the dense columns as U D U'
  std::uint32_t active[Layout::kColumns] = {};        // all ones: the column has uncertainty; 0: fixed or standby
  bool considered[Layout::kColumns] = {};             // counted, not updated (Kalman form)
  bool any_considered = false;
  float lambda[Layout::kColumns] = {};  // forgetting per sample, in (0, 1] (forgetting form)
  float noise[Layout::kColumns] = {};   // variance per sample, prior units (Kalman form)
  float link_floor = 0.0f;              // D of dense columns never falls below (Kalman form)
  float gate_sigma = 0.0f;              // innovations beyond are not used; 0: no gate (Kalman form)
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

// Full packed factor [front, dense] of the prior's correlation. Shape: ud [UdSize(kColumns)]. Context: background.
template <class Layout>
void ExpandPrior(const Prior<Layout>& prior, float* ud) {
  using math::UdIndex;
  for (int k = 0; k < math::UdSize(Layout::kColumns); ++k) ud[k] = 0.0f;
  for (int k = 0; k < Layout::kFront; ++k) ud[UdIndex(k, k)] = math::Masked(1.0f, prior.active[k]);
  for (int j = 0; j < Layout::kDense; ++j)
    for (int i = 0; i <= j; ++i) ud[UdIndex(Layout::kFront + i, Layout::kFront + j)] = prior.dense_ud[UdIndex(i, j)];
}

// kOk, kNotFinite or kOutOfRange for `length` elements. Context: background.
inline core::Status JudgeRow(const float* x, int length) {
  std::uint32_t largest = 0;
  for (int k = 0; k < length; ++k) {
    const std::uint32_t bits = math::BitsOf(x[k]) & 0x7FFFFFFFu;
    largest = bits > largest ? bits : largest;
  }
  if (largest >= 0x7F800000u) return core::Status::kNotFinite;
  return largest > math::BitsOf(kRowLimit) ? core::Status::kOutOfRange : core::Status::kOk;
}

}  // namespace armcal::filter
