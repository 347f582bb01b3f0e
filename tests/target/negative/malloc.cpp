// tests - a program that must not link: it takes memory from a heap.
#include <cstdlib>

#include "port/runner/runner.hpp"

int Program() {
  int* volatile taken = static_cast<int*>(std::malloc(16));  // volatile: GCC may not leave it out
  return taken == nullptr;
}
