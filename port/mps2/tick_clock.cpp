// mps2 - the registers of SysTick.
#include "port/mps2/tick_clock.hpp"

#include <atomic>

namespace armcal::port::mps2 {
namespace {

constexpr std::uint32_t kCore_Hz = 25000000;
constexpr std::uint32_t kControl = 0xE000E010, kReload = 0xE000E014, kValue = 0xE000E018;

volatile std::uint32_t& Register(std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

std::atomic<std::uint32_t> tick_count{0};
std::atomic<std::uint32_t> ms_count{0};
std::uint32_t rate_Hz = 1000;
std::uint32_t ms_remainder = 0;  // of a millisecond, in 1/(1000 rate_Hz), so that no rounding adds up

}  // namespace

void StartTick(std::uint32_t tick_rate_Hz) {
  rate_Hz = tick_rate_Hz;
  Register(kReload) = kCore_Hz / tick_rate_Hz - 1;
  Register(kValue) = 0;
  Register(kControl) = 7;  // core clock, interrupt, enabled
}

std::uint32_t CountTick() {
  ms_remainder += 1000;
  while (ms_remainder >= rate_Hz) {
    ms_remainder -= rate_Hz;
    ms_count.store(ms_count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  const std::uint32_t tick = tick_count.load(std::memory_order_relaxed) + 1;
  tick_count.store(tick, std::memory_order_relaxed);
  return tick;
}

std::uint32_t Ticks() { return tick_count.load(std::memory_order_relaxed); }
bool TickRuns() { return (Register(kControl) & 1u) != 0; }

hardware::Clock TickClock() {
  return {nullptr, [](void*) { return Ticks(); }, [](void*) { return ms_count.load(std::memory_order_relaxed); }};
}

}  // namespace armcal::port::mps2
