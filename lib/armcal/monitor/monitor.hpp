// monitor - do the innovations have the size that the filter says; knows numbers, no filter and no model.
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

}  // namespace armcal::monitor
