// generator - compiles a function for several vector units; the program takes the widest one of its machine.
// All of them give the same bits, because nothing is contracted.
#pragma once

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define ARMCAL_VECTOR_UNITS(...) __attribute__((target_clones(__VA_ARGS__, "default")))
#else
#define ARMCAL_VECTOR_UNITS(...)
#endif

namespace armcal::codegen {

inline constexpr int kLanes = 4;
// As many values of a column, wherever they begin.
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(sizeof(double)), may_alias));
inline const Lanes& LanesAt(const double* v) { return *reinterpret_cast<const Lanes*>(v); }

}  // namespace armcal::codegen
