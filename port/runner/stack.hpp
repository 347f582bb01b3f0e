// runner - measures how much stack a call uses, by painting the stack below it.
#pragma once

#include <cstdint>

namespace armcal::port::runner {

// Bytes of stack that `call` used below the caller's own frame, up to 6 KB; 0 on a PC. Switch interrupts off before,
// because their stack would count as well.
template <class Call>
std::uint32_t StackOf(Call call) {
#ifdef __arm__
  constexpr std::uintptr_t kPainted_bytes = 6144;
  constexpr std::uint32_t kPaint = 0xC5C5C5C5u;
  std::uintptr_t top;
  __asm volatile("mov %0, sp" : "=r"(top));
  const auto word = [](std::uintptr_t address) { return reinterpret_cast<volatile std::uint32_t*>(address); };
  for (std::uintptr_t at = top - kPainted_bytes; at != top; at += 4) *word(at) = kPaint;
  call();
  std::uintptr_t lowest = top - kPainted_bytes;
  while (lowest != top && *word(lowest) == kPaint) lowest += 4;
  return static_cast<std::uint32_t>(top - lowest);
#else
  call();
  return 0;
#endif
}

}  // namespace armcal::port::runner
