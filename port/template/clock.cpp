// template - counts ticks and milliseconds.
#include "port/template/clock.hpp"

#include <atomic>

namespace armcal::port::target {
namespace {

std::atomic<std::uint32_t> tick_count{0};
std::atomic<std::uint32_t> ms_count{0};
std::uint32_t remainder = 0;  // of a millisecond, in 1/(1000 kTickRate_Hz), so that no rounding adds up

}  // namespace

hardware::Clock TargetClock() {
  return {nullptr, [](void*) { return tick_count.load(std::memory_order_relaxed); },
          [](void*) { return ms_count.load(std::memory_order_relaxed); }};
}

std::uint32_t CountTick() {
  for (remainder += 1000; remainder >= kTickRate_Hz; remainder -= kTickRate_Hz) {
    ms_count.store(ms_count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  const std::uint32_t tick = tick_count.load(std::memory_order_relaxed) + 1;
  tick_count.store(tick, std::memory_order_relaxed);
  return tick;
}

}  // namespace armcal::port::target
