// monitor - have the innovations the size that the filter says: per joint, and one verdict for all joints.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"

namespace armcal::monitor {

// Running statistics of one joint. Averages over the last kMemory rows or so (exactly over all, before that).
// A consistent filter has nis near 1; above 2 over hundreds of rows the model or its noise is wrong.
class JointMonitor {
 public:
  static constexpr std::uint32_t kMemory = 4096;  // 33 s at 125 Hz: several periods of a usual excitation

  // innovation, variance: whitened, of one accepted row. residual_Nm: measured minus committed model torque.
  // Not finite: kept out. Context: background.
  void Add(float innovation, float variance, float residual_Nm) {
    const float square = math::Divide(innovation * innovation, variance), residual = residual_Nm * residual_Nm;
    const bool good = math::IsFinite(square) && math::IsFinite(residual);
    const std::uint32_t mask = math::MaskOf(good);
    count_ += good;
    const float share = 1.0f / static_cast<float>(math::Max<std::uint32_t>(1, math::Min(count_, kMemory)));
    nis_ += math::Masked(share * (square - nis_), mask);
    mean_square_ += math::Masked(share * (residual - mean_square_), mask);
  }

  float nis() const { return nis_; }                                  // mean of innovation^2 / variance
  float residual_rms_Nm() const { return math::Sqrt(mean_square_); }  // of the committed model, used rows only
  std::uint32_t count() const { return count_; }

 private:
  std::uint32_t count_ = 0;
  float nis_ = 0.0f;
  float mean_square_ = 0.0f;
};

// What chi^2 of `freedom` degrees (> 0, need not be whole) passes as often as a normal number passes `sigmas`, less
// often where there are only a few degrees: Wilson and Hilferty's cube root.
inline float ChiSquareLimit(float freedom, float sigmas) {
  const float ninth = 2.0f / (9.0f * freedom), root = 1.0f - ninth + sigmas * math::Sqrt(ninth);
  return freedom * root * root * root;
}

// The innovations^2 / variance of a filter that knows its noise are independent and chi^2 of one degree. Their mean
// over a block of rows of all joints passes the limit once in a million: at 125 samples a second with six rows each, a
// consistent filter is called inconsistent once in two months. Noise that is larger than stated, or a torque that the
// model lacks, raises it. A wrong prior hardly does; the physical read-out shows that (estimator::PriorIsTooNarrow).
class InnovationTest {
 public:
  static constexpr int kBlockRows = 4096;
  static constexpr float kLimit = 1.1085f;  // of the mean: chi^2 quantile / rows

  // whitened, of one accepted row. Not finite: kept out. Context: background.
  void Add(float innovation, float variance) {
    const float square = math::Divide(innovation * innovation, variance);
    const bool good = math::IsFinite(square);
    sum_ += math::Masked(square, math::MaskOf(good));
    rows_ += good;
    if (rows_ < kBlockRows) return;
    mean_ = sum_ / static_cast<float>(kBlockRows);
    sum_ = 0.0f;
    rows_ = 0;
  }

  float mean() const { return mean_; }  // of the last full block; 0 before the first
  bool inconsistent() const { return mean_ > kLimit; }

 private:
  float sum_ = 0.0f, mean_ = 0.0f;
  int rows_ = 0;
};

}  // namespace armcal::monitor
