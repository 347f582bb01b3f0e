// tests - a large static object with a number that is not zero: the check after the link has to see it.
#include "port/runner/runner.hpp"

struct Numbers {
  float zero[64] = {};
  float one = 1.0f;
};
static Numbers numbers;
static float* volatile kept;

int Program() {
  kept = numbers.zero;
  return 0;
}
