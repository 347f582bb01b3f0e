// math - a b + c, for float with one rounding on every machine.
#pragma once

namespace armcal::math {

// float: rounded once on every machine, so that host and target agree bit for bit. That is one instruction on a
// Cortex-M4F or M7. A host without such an instruction calls the C library's exact fmaf. double: rounded once if the
// compiler defines __FMA__, else twice. Other scalars: rounded twice. Context: any.
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

// True if the code around the call is compiled with contraction: a b + c of floats is then rounded once or twice as the
// compiler likes, and the results are no longer those of other machines. GCC and clang contract by default if the core
// has the instruction; -ffp-contract=off forbids it. No compiler tells a program of it, so this is tried when the
// program runs: the square below is no float, and its rounded value leaves a rest only if the subtraction sees the
// exact one. Context: any.
[[gnu::always_inline]] inline bool Contracts() {
  const volatile float x = 1.000244140625f;  // 1 + 2^-12; volatile: each product is computed, and from its own factors
  const volatile float rounded = x * x;
  const float a = x, b = x, c = rounded;
  return a * b - c != 0.0f;
}

}  // namespace armcal::math
