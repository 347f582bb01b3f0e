// hardware - the clock that a target supplies.
#pragma once

#include <cstdint>

namespace armcal::hardware {

// Both counters are integers, because a float would lose ticks after some hours. They wrap, and only differences are
// used. Context: any.
struct Clock {
  void* context;
  std::uint32_t (*ticks)(void* context);  // control ticks since power-up
  std::uint32_t (*ms)(void* context);     // milliseconds, for time-outs

  std::uint32_t Ticks() const { return ticks(context); }
  std::uint32_t Ms() const { return ms(context); }
};

}  // namespace armcal::hardware
