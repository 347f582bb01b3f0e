// tests - one control tick in a recorded trace, as bytes in a file; knows no arm.
#pragma once

#include <cstdint>

namespace armcal::target {

// Little-endian, as every machine that reads it. Raw readings only, so that no computed bit depends on who made it.
struct TraceTick {
  std::int32_t counts[6];
  std::int16_t current[6];
  std::int16_t temperature_cdegC[6];  // hundredths of a degree
  std::uint8_t flags[8];              // of six joints; two spare
};
static_assert(sizeof(TraceTick) == 56);

}  // namespace armcal::target
