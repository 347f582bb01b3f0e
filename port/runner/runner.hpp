// runner - what a test or a measurement needs of the machine that runs it.
//
// One program runs on three machines: linux.cpp (a process of a PC), mps2.cpp (the emulated boards), cortex_m.cpp (a
// board of yours).
#pragma once

#include <cstddef>
#include <cstdint>

// The program. The runner calls it once and ends with its answer. 0: all is well.
int Program();

namespace armcal::port::runner {

// Shows a text to the person or script that started the program.
void Write(const char* text);

// Reads from the input file that the program was started with, and returns the number of bytes. 0: the file has ended,
// or there is none.
std::size_t Read(void* bytes, std::size_t capacity);

// Count() reads a running counter. Spent() is what was spent between two readings: instructions on the emulated boards,
// core cycles on a real board, 0 on a PC. It is exact below 2^28.
std::uint32_t Count();
std::uint32_t Spent(std::uint32_t from, std::uint32_t to);

// Calls tick() `count` times, and background() in between and until it answers false. On the emulated boards tick() is
// an interrupt, which comes every `period` instructions wherever background() is. On the other machines the two take
// turns.
void RunContexts(std::uint32_t count, std::uint32_t period, void (*tick)(), bool (*background)());

// One tick, then background() until it answers false, and so on.
inline void TakeTurns(std::uint32_t count, void (*tick)(), bool (*background)()) {
  for (; count != 0; --count) {
    tick();
    while (background()) {
    }
  }
}

}  // namespace armcal::port::runner
