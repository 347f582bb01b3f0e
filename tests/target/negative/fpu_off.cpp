// tests - a program that must fault: a float instruction with the floating-point unit off.
#include <cstdint>

#include "port/runner/runner.hpp"

int Program() {
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88u) = 0;  // CPACR
  __asm volatile("dsb\n isb\n vmov.f32 s0, s0" ::: "memory");
  return 0;
}
