// filter - prepares one whitened row: checks its numbers and copies it to the order of a factor.
#pragma once

#include "armcal/filter/order.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/math/columns.hpp"
#include "armcal/math/elementary.hpp"

namespace armcal::filter {

inline constexpr float kRowLimit = 1e6f;  // a larger element means a broken model, and float32 would overflow

// A row is checked by its element of largest magnitude. The answer is kOk, kNotFinite or kOutOfRange. Context:
// background.
inline std::uint32_t MagnitudeBits(float x) { return math::BitsOf(x) & 0x7FFFFFFFu; }
inline core::Status Judge(std::uint32_t largest_magnitude_bits) {
  const unsigned over = largest_magnitude_bits > math::BitsOf(kRowLimit), wild = largest_magnitude_bits >= 0x7F800000u;
  static_assert(static_cast<int>(core::Status::kNotFinite) == 1 && static_cast<int>(core::Status::kOutOfRange) == 2);
  return static_cast<core::Status>(2u * over - wild);  // without a branch: what is not finite is over the limit, too
}
// kOk becomes kGated if the row is not taken.
inline core::Status GatedUnless(bool taken, core::Status judged) {
  const unsigned gated = !taken & (judged == core::Status::kOk);
  return static_cast<core::Status>(static_cast<unsigned>(judged) | gated * static_cast<unsigned>(core::Status::kGated));
}
// Fills in status and accepted of the report, before the filter takes the row. Returns the mask for the row's elements:
// zero if the row is not used.
inline std::uint32_t Admit(bool use, std::uint32_t largest_magnitude_bits, UpdateReport& report) {
  report.status = Judge(largest_magnitude_bits);
  report.accepted = use & (report.status == core::Status::kOk);
  report.status = GatedUnless(use, report.status);
  return math::MaskOf(report.accepted);
}

// The bits of the largest magnitude of value[k], k < count, and `largest`.
ARMCAL_NOINLINE inline std::uint32_t LargestOf(const float* value, int count, std::uint32_t largest) {
  math::internal::ByFours(count, [&](int k) ARMCAL_INLINE { largest = math::Max(largest, MagnitudeBits(value[k])); });
  return largest;
}
// h[k * stride] = value[k] for k < count, or zero if the mask is.
template <int stride>
ARMCAL_NOINLINE void CopyMasked(const float* __restrict value, int count, std::uint32_t mask, float* __restrict h) {
  math::internal::ByFours(count, [&](int k) ARMCAL_INLINE { h[k * stride] = math::Masked(value[k], mask); });
}

// h[position[k] * stride] = value[k] for k < count, or zero if the mask is.
template <int stride>
ARMCAL_NOINLINE void Scatter(const float* value, const std::uint8_t* position, int count, std::uint32_t mask,
                             float* h) {
  for (int k = 0; k < count; ++k) h[position[k] * stride] = math::Masked(value[k], mask);
}

// Writes the row of `joint` to h, which is zero: element p to h[p * stride]. eta [kNonlinear] is read only if the order
// has eta columns. If the row is not used, h stays zero. Returns the mask of Admit. Context: background.
template <class Layout, class Columns, int stride>
std::uint32_t FillRow(int joint, const float* front, const float* dense, [[maybe_unused]] const float* eta, float y,
                      bool use, float* h, UpdateReport& report) {
  constexpr const auto& at = Columns::kAt.position;
  const int begin = Layout::kFrontBegin[joint], width = Layout::kFrontBegin[joint + 1] - begin;
  const int first = Layout::kRowBegin[joint], seen = Layout::kDense - first;
  std::uint32_t largest = LargestOf(front, width, LargestOf(dense + first, seen, MagnitudeBits(y)));
  if constexpr (Columns::kBeside == Beside::kEta) largest = LargestOf(eta, Layout::kNonlinear, largest);
  const std::uint32_t taken = Admit(use, largest, report);
  Scatter<stride>(front, at + begin, width, taken, h);
  Scatter<stride>(dense + first, at + Layout::kFront + first, seen, taken, h);
  if constexpr (Columns::kBeside == Beside::kEta)
    Scatter<stride>(eta, at + Layout::kColumns, Layout::kNonlinear, taken, h);
  return taken;
}

}  // namespace armcal::filter
