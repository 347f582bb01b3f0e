// filter - the prior of a filter: start covariance, forgetting, process noise, and which columns are considered.
//
// Prior units: x_k = (b_k - b0_k) / s_k, where s_k^2 is the prior variance of column k. So every active column starts
// with mean 0 and variance 1. Whitened rows: y = (tau - Y b0) / sigma and h_k = Y_k s_k / sigma, so the noise has
// variance 1. In the prior, dense columns are correlated with each other, and a front column is independent of all
// others.
//
// Layout is a struct of constants (a generated model is one): kJoints, kFront, kFrontBegin[kJoints + 1], kDense,
// kRowBegin[kJoints], kColumns = kFront + kDense, kNonlinear. See model/contract.hpp. The nonlinear parameters eta are
// columns of the extended filter only. They are numbered from kColumns on, and are independent of all others.
#pragma once

#include <cstdint>

#include "armcal/math/symmetric.hpp"

namespace armcal::filter {

template <class Layout>
struct Prior {
  static constexpr int kStates = Layout::kColumns + Layout::kNonlinear;
  float dense_ud[Layout::kDense > 0 ? math::UdSize(Layout::kDense) : 1] =
      {};                              // correlation of the dense columns as U D U'
  std::uint32_t active[kStates] = {};  // all ones: the column has uncertainty; 0: fixed or standby
  bool considered[kStates] = {};       // its uncertainty counts, but no row changes it (Kalman form)
  bool any_considered = false;
  float lambda[kStates] = {};  // forgetting per sample, in (0, 1] (forgetting form)
  float noise[kStates] = {};   // variance per sample, prior units (Kalman form)
  float link_floor = 0.0f;     // the smallest D of a dense column and of eta (Kalman form)
};

// The joint of a front column, or kJoints for any other column. It takes the same instructions for every column.
template <class Layout>
constexpr int JointOf(int column) {
  int joint = 0;
  for (int i = 0; i < Layout::kJoints; ++i) joint += column >= Layout::kFrontBegin[i + 1];
  return joint;
}

// The columns that a reset takes together: the front columns of a joint, or (block kJoints) all other columns.
struct ColumnRange {
  int begin, end;
};
template <class Layout>
constexpr ColumnRange ColumnsOfBlock(int block, int columns) {
  if (block < Layout::kJoints) return {Layout::kFrontBegin[block], Layout::kFrontBegin[block + 1]};
  return {Layout::kFront, columns};
}

}  // namespace armcal::filter
