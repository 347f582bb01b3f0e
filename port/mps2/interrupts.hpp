// mps2 - the functions that the board calls, and the record that a fault leaves.
#pragma once

#include <cstdint>

extern "C" {
[[noreturn]] void Application();  // of the application: called after reset, never returns
void TickInterrupt();             // of the application: called by SysTick
void SerialInterrupt();           // of the application: UART1 has received
[[noreturn]] void Fault();        // fault.cpp: for any fault, and for an interrupt that nobody serves
}

namespace armcal::port::mps2 {

// A debugger reads it after a fault. `happened` is 0 before.
struct FaultRecord {
  std::uint32_t configurable, hard, happened;  // CFSR, HFSR
};
extern FaultRecord fault_record;

// Sleeps until an interrupt comes. Call it when nothing is left to do.
inline void Sleep() { __asm volatile("wfi" ::: "memory"); }

}  // namespace armcal::port::mps2
