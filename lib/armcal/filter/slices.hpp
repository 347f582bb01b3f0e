// filter - how long work is cut into slices; knows no filter.
//
// Work is counted in elements of a factor's column: eight instructions each on a Cortex-M4F. A call is given `credit`,
// takes off what it spends, and stops at the next place where it can once none is left. The caller adds to what is left
// over, debts too, so that slices stay equal: only the last one may be off by what cannot be cut.
#pragma once

namespace armcal::filter {

inline constexpr int kSliceCredit = 2400;  // some 20 000 instructions: 0.2 ms on a Cortex-M4F at 168 MHz
inline constexpr int kNoSlices = 1 << 30;  // enough for anything in one call

// Credit of each slice when work of that cost is cut into equal ones.
constexpr int EqualSlices(int cost) {
  const int slices = (cost + kSliceCredit / 2) / kSliceCredit;
  return slices > 1 ? (cost + slices - 1) / slices : cost;
}

}  // namespace armcal::filter
