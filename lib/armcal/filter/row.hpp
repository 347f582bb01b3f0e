// filter - one whitened row: what is fit to be used of it, and where its elements stand in a factor; knows no filter.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/filter/order.hpp"
#include "armcal/math/columns.hpp"
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

// A row is judged by its largest element in magnitude: kOk, kNotFinite or kOutOfRange. Context: background.
inline std::uint32_t MagnitudeBits(float x) { return math::BitsOf(x) & 0x7FFFFFFFu; }
inline core::Status Judge(std::uint32_t largest_magnitude_bits) {
  const unsigned over = largest_magnitude_bits > math::BitsOf(kRowLimit), wild = largest_magnitude_bits >= 0x7F800000u;
  static_assert(static_cast<int>(core::Status::kNotFinite) == 1 && static_cast<int>(core::Status::kOutOfRange) == 2);
  return static_cast<core::Status>(2u * over - wild);  // what is not finite is over any limit; no branch
}
// kOk becomes kGated unless the row was taken.
inline core::Status GatedUnless(bool taken, core::Status judged) {
  const unsigned gated = !taken & (judged == core::Status::kOk);
  return static_cast<core::Status>(static_cast<unsigned>(judged) | gated * static_cast<unsigned>(core::Status::kGated));
}
// What is known of a row before it is worked in. Returns the mask of its elements: zero unless the row is used.
inline std::uint32_t Admit(bool use, std::uint32_t largest_magnitude_bits, UpdateReport& report) {
  report.status = Judge(largest_magnitude_bits);
  report.accepted = use & (report.status == core::Status::kOk);
  report.status = GatedUnless(use, report.status);
  return math::MaskOf(report.accepted);
}

// h[position[k]] = value[k], k < count. Returns the largest magnitude's bits.
ARMCAL_NOINLINE inline std::uint32_t Scatter(const float* value, const std::uint8_t* position, int count, float* h) {
  std::uint32_t largest = 0;
  for (int k = 0; k < count; ++k) {
    largest = math::Max(largest, MagnitudeBits(value[k]));
    h[position[k]] = value[k];
  }
  return largest;
}

// h at positions [first, kSize) of a row of `joint` that begins there; eta [kNonlinear] where the order has it. All of
// it zero unless the row is used; returns the mask. Context: background.
template <class Layout, class Columns>
std::uint32_t FillRow(int joint, const float* front, const float* dense, [[maybe_unused]] const float* eta, float y,
                      bool use, float* h, UpdateReport& report) {
  constexpr const auto& at = Columns::kAt.position;
  const int first = Columns::kAt.first[joint], begin = Layout::kFrontBegin[joint], seen = Layout::kRowBegin[joint];
  for (int p = first; p < Columns::kSize; ++p) h[p] = 0.0f;
  std::uint32_t largest = Scatter(front, at + begin, Layout::kFrontBegin[joint + 1] - begin, h);
  largest = math::Max(largest, Scatter(dense + seen, at + Layout::kFront + seen, Layout::kDense - seen, h));
  if constexpr (Columns::kBeside == Beside::kEta)
    largest = math::Max(largest, Scatter(eta, at + Layout::kColumns, Layout::kNonlinear, h));
  const std::uint32_t taken = Admit(use, math::Max(largest, MagnitudeBits(y)), report);
  for (int p = first; p < Columns::kSize; ++p) h[p] = math::Masked(h[p], taken);
  return taken;
}

}  // namespace armcal::filter
