// port_linux - the machine's monotonic time as the port's clock; knows no application.
#pragma once

#include <atomic>
#include <cstdint>

#include "armcal/hardware/clock.hpp"

namespace armcal::port_linux {

// Milliseconds of the machine; ticks as counted by the application in `ticks`, which outlives the clock.
hardware::Clock SteadyClock(std::atomic<std::uint32_t>& ticks);

}  // namespace armcal::port_linux
