// math - a b + c, with one rounding where the machine can do that in one instruction.
#pragma once

namespace armcal::math {

// float: rounded once everywhere, so that host and target agree bit for bit. It is one instruction on Cortex-M4F and
// M7, and the C library's exact fmaf on a host that has no such instruction. Other scalars: rounded once where that is
// one instruction, else twice. Context: any.
inline float MulAdd(float a, float b, float c) { return __builtin_fmaf(a, b, c); }

inline double MulAdd(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(a, b, c);
#else
  return a * b + c;
#endif
}

template <class T>
T MulAdd(const T& a, const T& b, const T& c) {
  return a * b + c;
}

}  // namespace armcal::math
