// tests - a firmware that must not pass: a double slipped in.
#include "port/runner/runner.hpp"

int Program() {
  volatile float x = 1.5f;
  x = static_cast<float>(static_cast<double>(x) * 1.1);
  return x < 0.0f;
}
