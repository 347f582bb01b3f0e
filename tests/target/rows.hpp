// tests - rows of a six-axis layout, good ones and such that a filter must keep out.
#pragma once

#include <limits>

#include "tests/target/filter_calls.hpp"
#include "tests/target/numbers.hpp"

namespace armcal::target {

enum class RowKind { kPlain, kGated, kNotFinite, kBeyondLimit, kTiny, kZero, kOutlier, kKinds };

class Rows {
 public:
  explicit Rows(const FilterCalls& filter) : filter_(filter), numbers_(static_cast<std::uint32_t>(filter.columns)) {
    for (float& p : truth_) p = numbers_.Signed();
  }

  // Three in four rows are plain.
  RowKind Draw() {
    const int kind = numbers_.Below(28);
    return kind < static_cast<int>(RowKind::kKinds) ? static_cast<RowKind>(kind) : RowKind::kPlain;
  }

  // A row of the given joint; valid until the next. y follows a fixed truth, with noise.
  Row Next(int joint, RowKind kind) {
    constexpr int kDense = 36;
    const int width = filter_.front / 6, own = filter_.nonlinear / 6;
    const float size = kind == RowKind::kTiny ? 1e-20f : kind == RowKind::kZero ? 0.0f : 1.0f;
    float y = 0.0f;
    for (int k = 0; k < width; ++k) y += truth_[kDense + joint * width + k] * (front_[k] = size * numbers_.Signed());
    for (int k = 0; k < kDense; ++k)
      y += truth_[k] * (dense_[k] = k < filter_.row_begin[joint] ? 0.0f : size * numbers_.Signed());
    for (int k = 0; k < filter_.nonlinear; ++k)
      y += truth_[kDense + filter_.front + k] *
           (eta_[k] = k / (own > 0 ? own : 1) == joint ? size * numbers_.Signed() : 0.0f);
    for (int k = 0; k < 3; ++k) y += numbers_.Signed();  // unit variance
    if (kind == RowKind::kNotFinite) dense_[kDense - 1] = std::numeric_limits<float>::quiet_NaN();
    if (kind == RowKind::kBeyondLimit) dense_[kDense - 2] = 2e6f;
    if (kind == RowKind::kOutlier) y += 1e4f;
    return {joint, front_, dense_, eta_, y, kind != RowKind::kGated};
  }

 private:
  const FilterCalls& filter_;
  Numbers numbers_;
  float truth_[102] = {}, front_[11] = {}, dense_[36] = {}, eta_[12] = {};
};

}  // namespace armcal::target
