// template - the clock of a new target: ticks and milliseconds.
#pragma once

#include <cstdint>

#include "armcal/hardware/clock.hpp"

namespace armcal::port::target {

inline constexpr std::uint32_t kTickRate_Hz = 1000;  // the rate of your control tick

hardware::Clock TargetClock();

// Your control tick calls this once, before anything else. Returns the number of the tick, which goes into
// RawSample::tick.
std::uint32_t CountTick();

}  // namespace armcal::port::target
