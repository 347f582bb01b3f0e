// math - the inner loops of every triangular factor, on one column or on two at once.
//
// A loop over two columns reads and writes the vector that they share only once. That takes seven instructions for an
// element on a Cortex-M4F instead of eight, and half of the loop's own instructions. Each element sees the same
// operations in the same order as if one column came after the other, so the bits are the same. A multiplication and an
// addition stay two operations: this gives the same bits everywhere, and on a Cortex-M4F it takes two cycles where the
// fused operation takes three. Context: any.
#pragma once

#include "armcal/math/elementary.hpp"  // refuses -ffast-math, which would reorder the sums

namespace armcal::math {

// Inlined even at -Os, which would otherwise call a loop's body four times.
#define ARMCAL_INLINE __attribute__((always_inline))
// Never inlined: one copy serves all callers of a firmware, and the callers keep their registers.
#ifdef __clang__
#define ARMCAL_NOINLINE __attribute__((noinline))
#else
#define ARMCAL_NOINLINE __attribute__((noinline, noclone))
#endif

namespace internal {
template <class T>
inline void BiermanElement(T& u, T& gain, T shift, T v) {
  const T before = u, sum = gain;
  u = before + sum * shift;
  gain = sum + before * v;
}
template <class T>
inline void FoldElement(T& x, T& r, T x0, T s) {
  const T before = r, rest = x - x0 * before;
  x = rest;
  r = before + s * rest;
}
// Calls turn(k) for all k < length, in groups of four as long as four are left. The loop is inlined together with the
// turn, so that the compiler still knows which pointers do not overlap.
template <class Turn>
ARMCAL_INLINE inline void ByFours(int length, Turn turn) {
  int k = 0;
  for (; k + 3 < length; k += 4) {
    turn(k);
    turn(k + 1);
    turn(k + 2);
    turn(k + 3);
  }
  for (; k < length; ++k) turn(k);
}
}  // namespace internal

// sum + the sum of a[k] b[k] for k < length.
template <class T>
ARMCAL_NOINLINE T Dot(const T* __restrict a, const T* __restrict b, int length, T sum = T(0)) {
  internal::ByFours(length, [&](int k) ARMCAL_INLINE { sum += a[k] * b[k]; });
  return sum;
}
// The same for two columns a1 and a2 with one b.
template <class T>
struct Two {
  T first, second;
};
template <class T>
ARMCAL_NOINLINE Two<T> Dots(const T* __restrict a1, const T* __restrict a2, const T* __restrict b, int length, T sum1,
                            T sum2) {
  internal::ByFours(length, [&](int k) ARMCAL_INLINE {
    const T x = b[k];
    sum1 += a1[k] * x;
    sum2 += a2[k] * x;
  });
  return {sum1, sum2};
}

// x += step a. Shapes: [length].
template <class T>
void AddScaled(T* __restrict x, const T* __restrict a, T step, int length) {
  for (int k = 0; k < length; ++k) x[k] += a[k] * step;
}

// One column of Bierman's measurement update: u += gain shift and gain += u v, both with the old u and the old gain.
template <class T>
void BiermanColumn(T* __restrict u, T* __restrict gain, T shift, T v, int length) {
  for (int k = 0; k < length; ++k) internal::BiermanElement(u[k], gain[k], shift, v);
}
// The same with column u1, then with u2.
template <class T>
ARMCAL_NOINLINE void BiermanColumns(T* __restrict u1, T* __restrict u2, T* __restrict gain, T shift1, T v1, T shift2,
                                    T v2, int length) {
  internal::ByFours(length, [&](int k) ARMCAL_INLINE {
    T sum = gain[k];
    internal::BiermanElement(u1[k], sum, shift1, v1);
    internal::BiermanElement(u2[k], sum, shift2, v2);
    gain[k] = sum;
  });
}

// Subtracts x0 times r from x, then adds s times what is left of x to r. This is a Givens rotation without square
// roots, and also a column of a rank-one sum. r changes by a small correction, so that little is lost to rounding.
template <class T>
void Fold(T* __restrict x, T* __restrict r, T x0, T s, int length) {
  for (int k = 0; k < length; ++k) internal::FoldElement(x[k], r[k], x0, s);
}
// The same with r1, then with r2. Every load of a turn stands before its first store. Compilers keep that order, and a
// core that issues in order (Cortex-M7) would otherwise wait for each element's chain before it starts the next one.
template <class T>
ARMCAL_NOINLINE void Fold(T* __restrict x, T* __restrict r1, T* __restrict r2, T x1, T s1, T x2, T s2, int length) {
  int k = 0;
  for (; k + 3 < length; k += 4) {
    T x_a = x[k], x_b = x[k + 1], x_c = x[k + 2], x_d = x[k + 3];
    T a1 = r1[k], b1 = r1[k + 1], c1 = r1[k + 2], d1 = r1[k + 3];
    T a2 = r2[k], b2 = r2[k + 1], c2 = r2[k + 2], d2 = r2[k + 3];
    internal::FoldElement(x_a, a1, x1, s1), internal::FoldElement(x_b, b1, x1, s1);
    internal::FoldElement(x_c, c1, x1, s1), internal::FoldElement(x_d, d1, x1, s1);
    internal::FoldElement(x_a, a2, x2, s2), internal::FoldElement(x_b, b2, x2, s2);
    internal::FoldElement(x_c, c2, x2, s2), internal::FoldElement(x_d, d2, x2, s2);
    r1[k] = a1, r1[k + 1] = b1, r1[k + 2] = c1, r1[k + 3] = d1;
    r2[k] = a2, r2[k + 1] = b2, r2[k + 2] = c2, r2[k + 3] = d2;
    x[k] = x_a, x[k + 1] = x_b, x[k + 2] = x_c, x[k + 3] = x_d;
  }
  for (; k < length; ++k) {
    T rest = x[k];
    internal::FoldElement(rest, r1[k], x1, s1);
    internal::FoldElement(rest, r2[k], x2, s2);
    x[k] = rest;
  }
}

// A row worked into a unit upper triangle R by Givens rotations without square roots: W. M. Gentleman, Least squares
// computations by Givens transformations without square roots, 1973. The triangle stands for the information R' diag(d)
// R. A row of zeros leaves every bit as it was.

// Adds x0, which has the given weight, to d. Fills in s: the share of the remainder that the stored row takes. Returns
// the weight of the remainder.
template <class T>
T GivensPivot(T& d, T x0, T weight, T& s) {
  const T wx = weight * x0;
  const T next = d + wx * x0;
  const T inverse = T(1) / next;
  const T remaining = weight * (d * inverse);
  s = wx * inverse;
  d = next;
  return remaining;
}

// Works a row (x0, x) of the given weight into two stored rows with d > 0: (1, r1[0..length]), which eliminates x0, and
// after it (1, r2[0..length - 1]), which eliminates what is left of x[0]. With length 0 there is only the first stored
// row. Shapes: x and r1 [length + 1], r2 [length]. x becomes what remains of the row. Returns the weight of that.
template <class T>
T GivensRows(T* d1, T* __restrict r1, T* d2, T* __restrict r2, T x0, T* __restrict x, int length, T weight) {
  T s1, s2;
  weight = GivensPivot(*d1, x0, weight, s1);
  internal::FoldElement(x[0], r1[0], x0, s1);
  if (length == 0) return weight;
  const T x1 = x[0];
  weight = GivensPivot(*d2, x1, weight, s2);
  Fold(x + 1, r1 + 1, r2, x0, s1, x1, s2, length);
  return weight;
}

}  // namespace armcal::math
