// runner - what a test or a measurement needs of the machine that runs it; knows no program and no room of armcal.
//
// One program, three machines: linux.cpp (a process), mps2.cpp (the emulated boards), cortex_m.cpp (a board of yours).
#pragma once

#include <cstddef>
#include <cstdint>

// The program. The runner calls it once and ends with its answer; 0: all is well.
int Program();

namespace armcal::port::runner {

// Text for whoever started the program.
void Write(const char* text);

// Bytes moved from the input file that the program was started with; 0 at its end, or without one.
std::size_t Read(void* bytes, std::size_t capacity);

// A running counter, and what was spent between two of its readings: instructions on the emulated boards, core cycles
// on a real one, 0 on a PC. Spent is exact for less than 2^28.
std::uint32_t Count();
std::uint32_t Spent(std::uint32_t from, std::uint32_t to);

// Calls tick() `count` times and background() in between and until it answers false. On the emulated boards tick() is
// an interrupt, every `period` instructions, and falls into background() wherever that happens to be; elsewhere the two
// take turns.
void RunContexts(std::uint32_t count, std::uint32_t period, void (*tick)(), bool (*background)());

// The two taking turns.
inline void TakeTurns(std::uint32_t count, void (*tick)(), bool (*background)()) {
  for (; count != 0; --count) {
    tick();
    while (background()) {
    }
  }
}

}  // namespace armcal::port::runner
