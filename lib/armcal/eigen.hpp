// armcal - views of joint vectors, estimates and deviations as Eigen vectors, and a block of a filter's covariance.
//
// Optional: nothing else of the library needs Eigen. Include it before any header of Eigen, because it makes Eigen
// allocate nothing and send failed assertions to Trap, with and without NDEBUG. Take matrices of fixed size only.
#pragma once

#if defined(EIGEN_WORLD_VERSION) && !defined(ARMCAL_EIGEN_TRAP)
#error "include armcal/eigen.hpp before any header of Eigen"
#endif

namespace armcal::eigen {

// Eigen calls this when one of its assertions fails. It executes an undefined instruction, so the core raises a fault.
[[noreturn]] inline void Trap() { __builtin_trap(); }

}  // namespace armcal::eigen

#ifndef ARMCAL_EIGEN_TRAP
#define ARMCAL_EIGEN_TRAP
#define EIGEN_NO_MALLOC
#define EIGEN_NO_IO
#define eigen_assert(condition) (static_cast<bool>(condition) ? static_cast<void>(0) : ::armcal::eigen::Trap())
#endif

#include <Eigen/Core>

namespace armcal::eigen {

// The array itself as a column vector; nothing is copied. For q, qd, qdd and tau of a sample or a set-point, for value
// and sd of estimates, and for any other array of floats. It lives no longer than the array. Context: any.
template <int n>
Eigen::Map<Eigen::Matrix<float, n, 1>> View(float (&values)[n]) {
  return Eigen::Map<Eigen::Matrix<float, n, 1>>(values);
}
template <int n>
Eigen::Map<const Eigen::Matrix<float, n, 1>> View(const float (&values)[n]) {
  return Eigen::Map<const Eigen::Matrix<float, n, 1>>(values);
}

// Writes the covariance of m chosen columns of a filter of the Kalman forms into a matrix of the caller. The filter
// holds packed factors only, so the block is a sum over all columns: Begin, then Step until it returns true. The filter
// must not take a row before that. Context: background.
template <class Filter, int m>
class CovarianceBlock {
 public:
  using Block = Eigen::Matrix<float, m, m>;

  // columns: numbers of filter columns, each below Filter::kSize. scale [Filter::kSize]: AdoptedTable::scale; the block
  // is then in the parameters' own units. nullptr: in prior units. `block` must live until the end.
  void Begin(const int (&columns)[m], const float* scale, Block& block) {
    for (int k = 0; k < m; ++k) {
      eigen_assert(columns[k] >= 0 && columns[k] < Filter::kSize);
      column_[k] = columns[k];
      scale_[k] = scale == nullptr ? 1.0f : scale[columns[k]];
    }
    block.setZero();
    block_ = &block;
    next_ = 0;
  }

  // Adds `count` terms of the sum, about 4 Filter::kSize + 3 m^2 instructions each. Returns true when all terms are
  // added.
  bool Step(const Filter& filter, int count) {
    for (; count > 0 && next_ < Filter::kSize; --count, ++next_) {
      float u[Filter::kSize];
      const float d = filter.estimate().Spread(next_, u);
      Eigen::Matrix<float, m, 1> part;
      for (int k = 0; k < m; ++k) part[k] = u[column_[k]] * scale_[k];
      const Eigen::Matrix<float, m, 1> weighted = d * part;
      block_->noalias() += weighted * part.transpose();
    }
    return next_ == Filter::kSize;
  }

 private:
  int column_[m] = {};
  float scale_[m] = {};
  Block* block_ = nullptr;
  int next_ = 0;
};

}  // namespace armcal::eigen
