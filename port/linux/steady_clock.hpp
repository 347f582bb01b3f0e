// port_linux - the monotonic time of the machine as lib's clock.
#pragma once

#include <atomic>
#include <cstdint>

#include "armcal/hardware/clock.hpp"

namespace armcal::port_linux {

// Milliseconds are the machine's. Ticks are what the application counts in `ticks`, which outlives the clock.
hardware::Clock SteadyClock(std::atomic<std::uint32_t>& ticks);

}  // namespace armcal::port_linux
