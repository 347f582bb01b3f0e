// port_linux - the monotonic time of the machine as lib's clock.
#include "port/linux/steady_clock.hpp"

#include <chrono>

namespace armcal::port_linux {

namespace {

std::uint32_t Ticks(void* context) {
  return static_cast<std::atomic<std::uint32_t>*>(context)->load(std::memory_order_relaxed);
}

std::uint32_t Milliseconds(void*) {
  using std::chrono::duration_cast;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<std::uint32_t>(duration_cast<std::chrono::milliseconds>(now).count());
}

}  // namespace

hardware::Clock SteadyClock(std::atomic<std::uint32_t>& ticks) { return {&ticks, &Ticks, &Milliseconds}; }

}  // namespace armcal::port_linux
