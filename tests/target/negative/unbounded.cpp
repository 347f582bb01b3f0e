// tests - functions whose stack has no bound, for the stack check to find; never run.
#include <cstdint>

std::uint32_t Even(std::uint32_t x);
[[gnu::noipa]] std::uint32_t Odd(std::uint32_t x) { return x == 0u ? 0u : Even(x - 1u) + 1u; }
[[gnu::noipa]] std::uint32_t Even(std::uint32_t x) { return x == 0u ? 1u : Odd(x - 1u) * 3u; }

[[gnu::noipa]] void Fill(char*, std::uint32_t) {}
void DataSized(std::uint32_t count) {
  char* room = static_cast<char*>(__builtin_alloca(count));
  Fill(room, count);
}

void ThroughPointer(void (*call)()) {
  call();
  __asm volatile("" ::: "memory");
}

void Deep() {
  char room[2000];
  Fill(room, sizeof room);
}
