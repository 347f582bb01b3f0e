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

}  // namespace armcal::math
