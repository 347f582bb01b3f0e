// mps2 - SysTick as control tick and clock.
#pragma once

#include <cstdint>

#include "armcal/hardware/clock.hpp"

namespace armcal::port::mps2 {

// Starts the tick interrupt. tick_rate_Hz: 2 to 1000000, an integer part of the core clock (25 MHz).
void StartTick(std::uint32_t tick_rate_Hz);

// Call it once in TickInterrupt. Returns the number of the tick that has begun.
std::uint32_t CountTick();

// How many ticks have begun, and whether StartTick has been called.
std::uint32_t Ticks();
bool TickRuns();

// Ticks, and milliseconds that are counted by ticks.
hardware::Clock TickClock();

}  // namespace armcal::port::mps2
