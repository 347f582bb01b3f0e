// filter - which joints must move so that a column forgets or gets process noise.
#pragma once

#include <cstdint>

namespace armcal::filter::test {

// Its own joint for a front column, all joints for any other column. A bit each.
template <class Layout>
constexpr std::uint32_t JointsOf(int column) {
  for (int i = 0; i < Layout::kJoints; ++i)
    if (column >= Layout::kFrontBegin[i] && column < Layout::kFrontBegin[i + 1]) return 1u << i;
  return (1u << Layout::kJoints) - 1u;
}

}  // namespace armcal::filter::test
