// tests - one control tick in a recorded trace, as bytes in a file.
#pragma once

#include "armcal/model/sample.hpp"

namespace armcal::target {

// Little-endian, as every machine that reads it. Raw readings only, so that no computed bit depends on who made it.
struct TraceTick {
  std::int32_t counts[6];
  std::int16_t current[6];
  std::int16_t temperature_cdegC[6];  // hundredths of a degree
  std::uint8_t flags[8];              // of six joints; two spare
};
static_assert(sizeof(TraceTick) == 56);

// All but the tick's number.
inline void Unpack(const TraceTick& tick, model::RawSample<6>& raw) {
  for (int i = 0; i < 6; ++i) {
    raw.counts[i] = tick.counts[i];
    raw.current[i] = tick.current[i];
    raw.flags[i] = tick.flags[i];
    raw.temperature_degC[i] = 0.01f * static_cast<float>(tick.temperature_cdegC[i]);
  }
}

}  // namespace armcal::target
