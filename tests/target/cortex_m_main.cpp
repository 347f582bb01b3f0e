// tests - what a board's own main does to run the bench; here it has to link.
#include "port/mps2/interrupts.hpp"
#include "port/runner/cortex_m.hpp"

// Start-up, clocks and linker script are the board's. Interrupts stay off.
extern "C" void Application() {
  (void)armcal::port::runner::Run();
  for (;;) armcal::port::mps2::Sleep();
}
extern "C" void TickInterrupt() {}
extern "C" void SerialInterrupt() {}
