// filter - one whitened row: what is fit to be used of it, and where its elements stand in a factor; knows no filter.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/filter/order.hpp"
#include "armcal/math/elementary.hpp"

namespace armcal::filter {

inline constexpr float kRowLimit = 1e6f;  // a larger element of a row means a broken model: float32 would overflow

// What one row did. Whitened units.
struct UpdateReport {
  float innovation = 0.0f;  // row minus its prediction by this filter before the row; 0 unless the row was judged
  float variance = 1.0f;    // its variance by this filter (forgetting form: from data alone, without the prior)
  bool accepted = false;
  core::Status status = core::Status::kGated;  // kOk, kGated, kNotFinite, kOutOfRange (element beyond kRowLimit)
};

// A row is judged by its largest element in magnitude: kOk, kNotFinite or kOutOfRange; a good one that is not accepted
// is kGated. No branch: a bad row costs what a good one does. Context: background.
inline std::uint32_t MagnitudeBits(float x) { return math::BitsOf(x) & 0x7FFFFFFFu; }
inline core::Status Judge(std::uint32_t largest_magnitude_bits) {
  static constexpr core::Status kBy[] = {core::Status::kOk, core::Status::kOutOfRange, core::Status::kNotFinite};
  return kBy[(largest_magnitude_bits > math::BitsOf(kRowLimit)) + (largest_magnitude_bits >= 0x7F800000u)];
}
inline core::Status Answer(core::Status judged, bool accepted) {
  static_assert(static_cast<int>(core::Status::kOk) == 0);
  const std::uint32_t gated = math::MaskOf((judged == core::Status::kOk) & !accepted);
  return static_cast<core::Status>(static_cast<std::uint32_t>(judged) |
                                   (gated & static_cast<std::uint32_t>(core::Status::kGated)));
}

// h [kSize] by positions, all zero before; eta [kNonlinear] where the order has it. Returns the largest magnitude's
// bits.
template <class Layout, class Columns>
std::uint32_t FillRow(int joint, const float* front, const float* dense, [[maybe_unused]] const float* eta, float* h) {
  std::uint32_t largest = 0;
  const auto put = [&](int column, float value) {
    largest = math::Max(largest, MagnitudeBits(value));
    h[Columns::kAt.position[column]] = value;
  };
  const int begin = Layout::kFrontBegin[joint], end = Layout::kFrontBegin[joint + 1];
  for (int k = begin; k < end; ++k) put(k, front[k - begin]);
  for (int k = Layout::kRowBegin[joint]; k < Layout::kDense; ++k) put(Layout::kFront + k, dense[k]);
  if constexpr (Columns::kBeside == Beside::kEta)
    for (int e = 0; e < Layout::kNonlinear; ++e) put(Layout::kColumns + e, eta[e]);
  return largest;
}

}  // namespace armcal::filter
