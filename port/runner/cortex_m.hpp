// runner - starts a program on a Cortex-M board with a debugger; knows no program and no board.
#pragma once

namespace armcal::port::runner {

// Switches the cycle counter on and runs the program. Call from your main with the clocks at full speed and interrupts
// off. Text goes out through ITM port 0, which the debugger shows as SWO output once it has enabled it.
int Run();

}  // namespace armcal::port::runner
