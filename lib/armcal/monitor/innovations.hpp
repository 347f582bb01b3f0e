// monitor - compares innovations with the variances that the filter predicts, per joint and for all joints.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"

namespace armcal::monitor {

// 1 on average if the variance is right.
inline float NormalisedSquare(float innovation, float variance) {
  return math::Divide(innovation * innovation, variance);
}

// Running statistics of one joint: the mean over all rows at first, later over about the last kMemory rows. nis, the
// mean normalised innovation squared, is near 1 if the filter's variances are right. If it stays above 2 for hundreds
// of rows, the model or its noise is wrong.
class JointMonitor {
 public:
  static constexpr std::uint32_t kMemory = 4096;  // 33 s at 125 Hz, which is several periods of a usual excitation

  // One accepted row. innovation, variance: whitened. residual_Nm: measured minus committed model's torque. A row with
  // a number that is not finite does not count. Context: background.
  void Add(float innovation, float variance, float residual_Nm) {
    const float square = NormalisedSquare(innovation, variance), residual = residual_Nm * residual_Nm;
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

// A limit for chi^2 of `freedom` degrees (> 0, not necessarily whole): chi^2 passes it as often as a normal number
// passes `sigmas`, or less often if there are only a few degrees. After Wilson and Hilferty, by the cube root.
inline float ChiSquareLimit(float freedom, float sigmas) {
  const float ninth = 2.0f / (9.0f * freedom), root = 1.0f - ninth + sigmas * math::Sqrt(ninth);
  return freedom * root * root * root;
}

// May a filter's standard deviations be believed? If a filter knows its noise, its innovations^2 / variance are
// independent, and each is chi^2 of one degree. The mean over a block of rows of all joints passes the limit once in a
// million blocks. At 125 samples a second with six rows each, a filter that is right is called inconsistent once in two
// months. The mean rises if the noise is larger than stated, or if the model lacks a torque. A wrong prior hardly
// raises it; the physical read-out shows that (estimator::PriorIsTooNarrow).
class InnovationTest {
 public:
  static constexpr int kBlockRows = 4096;
  static constexpr float kLimit = 1.1085f;  // of the mean: chi^2 quantile / rows

  // One accepted row, whitened. A row with a number that is not finite does not count. Context: background.
  void Add(float innovation, float variance) {
    const float square = NormalisedSquare(innovation, variance);
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
