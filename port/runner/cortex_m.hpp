// runner - starts a program on a Cortex-M board that has a debugger.
#pragma once

namespace armcal::port::runner {

// Switches the cycle counter on and runs the program. Call it from your main, with the clocks at full speed and the
// interrupts off. Text goes out through ITM port 0. The debugger shows it as SWO output after it has enabled the port.
int Run();

}  // namespace armcal::port::runner
