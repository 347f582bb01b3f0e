// runner - takes cycles from the DWT and sends text through the ITM, on any Cortex-M3, M4, M7 or later.
#include "port/runner/cortex_m.hpp"

#include "port/runner/runner.hpp"

namespace armcal::port::runner {
namespace {

volatile std::uint32_t& Register(std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

constexpr std::uint32_t kDebugControl = 0xE000EDFC, kTraceEnable = 1u << 24;
constexpr std::uint32_t kDwtControl = 0xE0001000, kDwtCycles = 0xE0001004, kDwtLock = 0xE0001FB0;
constexpr std::uint32_t kItmPort0 = 0xE0000000, kItmEnabledPorts = 0xE0000E00, kItmControl = 0xE0000E80;
constexpr std::uint32_t kUnlock = 0xC5ACCE55;  // a Cortex-M7's trace unit is locked after reset

}  // namespace

void Write(const char* text) {
  if ((Register(kItmControl) & 1u) == 0u || (Register(kItmEnabledPorts) & 1u) == 0u) return;  // nobody listens
  for (; *text != '\0'; ++text) {
    while ((Register(kItmPort0) & 1u) == 0u) {
    }
    *reinterpret_cast<volatile char*>(kItmPort0) = *text;
  }
}

std::size_t Read(void*, std::size_t) { return 0; }
std::uint32_t Count() { return Register(kDwtCycles); }
std::uint32_t Spent(std::uint32_t from, std::uint32_t to) { return to - from; }
void RunContexts(std::uint32_t count, std::uint32_t, void (*tick)(), bool (*background)()) {
  TakeTurns(count, tick, background);
}

int Run() {
  Register(kDebugControl) = Register(kDebugControl) | kTraceEnable;
  Register(kDwtLock) = kUnlock;
  Register(kDwtCycles) = 0;
  Register(kDwtControl) = Register(kDwtControl) | 1u;
  return Program();
}

}  // namespace armcal::port::runner
