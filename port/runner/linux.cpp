// runner - runs a program as a process of a PC: `program [input file]`.
#include <cstdio>

#include "port/runner/runner.hpp"

namespace {
std::FILE* input = nullptr;
}

namespace armcal::port::runner {

void Write(const char* text) { std::fputs(text, stdout); }
std::size_t Read(void* bytes, std::size_t capacity) {
  return input == nullptr ? 0 : std::fread(bytes, 1, capacity, input);
}
std::uint32_t Count() { return 0; }
std::uint32_t Spent(std::uint32_t, std::uint32_t) { return 0; }
void RunContexts(std::uint32_t count, std::uint32_t, void (*tick)(), bool (*background)()) {
  TakeTurns(count, tick, background);
}

}  // namespace armcal::port::runner

int main(int count, char** arguments) {
  if (count > 1 && (input = std::fopen(arguments[1], "rb")) == nullptr) {
    std::fprintf(stderr, "%s: cannot be read\n", arguments[1]);
    return 2;
  }
  return Program();
}
