// mps2 - who is called when, and what a fault leaves behind; knows no room of armcal.
#pragma once

#include <cstdint>

extern "C" {
[[noreturn]] void Application();  // the application's: after reset, for good
void TickInterrupt();             // the application's: SysTick
void SerialInterrupt();           // the application's: UART1 has received
[[noreturn]] void Fault();        // fault.cpp: any fault, and an interrupt that nobody serves
}

namespace armcal::port::mps2 {

// Readable by a debugger after a fault; `happened` is 0 before.
struct FaultRecord {
  std::uint32_t configurable, hard, happened;  // CFSR, HFSR
};
extern FaultRecord fault_record;

// Sleeps until an interrupt comes. Call with nothing left to do.
inline void Sleep() { __asm volatile("wfi" ::: "memory"); }

}  // namespace armcal::port::mps2
