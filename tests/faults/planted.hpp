// faults - which planted fault this process runs with; knows a number.
#pragma once

#include <cstdlib>

namespace armcal {

// From the environment, so that one executable serves all faults; 0: none.
inline const int planted_fault = [] {
  const char* number = std::getenv("ARMCAL_FAULT");
  return number == nullptr ? 0 : std::atoi(number);
}();

// What the compiler evaluates is always right.
constexpr bool Planted(int number) { return !__builtin_is_constant_evaluated() && number == planted_fault; }

}  // namespace armcal
