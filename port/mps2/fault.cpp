// mps2 - what the example firmware does after a fault.
#include "port/mps2/interrupts.hpp"

namespace armcal::port::mps2 {
FaultRecord fault_record;
}  // namespace armcal::port::mps2

// Keeps what the core says about the fault, for a debugger, and stops. In a drive this function disables the power
// stage.
extern "C" void Fault() {
  const auto reg = [](std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); };
  constexpr std::uint32_t kConfigurableFault = 0xE000ED28, kHardFault = 0xE000ED2C;
  armcal::port::mps2::fault_record = {reg(kConfigurableFault), reg(kHardFault), 1};
  __asm volatile("cpsid i");
  for (;;) {
  }
}
