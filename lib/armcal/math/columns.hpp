// math - the inner loops of every triangular factor, on one column or on two at once.
//
// A loop over two columns reads and writes the vector that they share only once. That takes seven instructions for an
// element on a Cortex-M4F instead of eight, and half of the loop's own instructions. Each element sees the same
// operations in the same order as if one column came after the other, so the bits are the same. A multiplication and an
// addition stay two operations: this gives the same bits everywhere, and on a Cortex-M4F it takes two cycles where the
// fused operation takes three. Context: any.
#pragma once

#include <cstdint>
#include <utility>

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

// A block of rows is worked in together: element k of row i is x[k * stride + i]. Several stored rows take them at a
// time. Each stored row takes the rows in their order, so the bits are those of one row after the other. But each
// element is loaded once for all stored rows, and each stored element once for all rows.
// Stored rows stand one behind the other: (1, r[0..]) for element 0, then (1, ...) for element 1, and so on; each of
// them has one element less than the one before. All have d > 0. `length`: the elements of a row after those that are
// eliminated.

namespace internal {
// Calls f for 0 .. count - 1, each a constant. Unrolled by hand: at -O2 a compiler keeps such loops and their arrays.
template <class F, int... k>
ARMCAL_INLINE inline void EachOf([[maybe_unused]] F f, std::integer_sequence<int, k...>) {
  (f(std::integral_constant<int, k>{}), ...);
}
template <int count, class F>
ARMCAL_INLINE inline void Each(F f) {
  EachOf(f, std::make_integer_sequence<int, count>{});
}

// `turns` elements of each row. They are loaded before the first store: a core that issues in order (Cortex-M7) would
// otherwise wait for each element's chain before it starts the next one.
template <int rows, int stored, int stride, int turns, class T>
ARMCAL_INLINE inline void FoldTurn(T* __restrict x, T* const* r, const T* c) {
  T own[turns * rows], kept[turns * stored];
  Each<turns>([&](auto t) ARMCAL_INLINE {
    Each<rows>([&](auto i) ARMCAL_INLINE { own[t * rows + i] = x[t * stride + i]; });
    Each<stored>([&](auto j) ARMCAL_INLINE { kept[t * stored + j] = r[j][t]; });
  });
  Each<rows>([&](auto i) ARMCAL_INLINE {
    Each<stored>([&](auto j) ARMCAL_INLINE {
      constexpr int kAt = 2 * (i * stored + j);
      Each<turns>([&](auto t)
                      ARMCAL_INLINE { FoldElement(own[t * rows + i], kept[t * stored + j], c[kAt], c[kAt + 1]); });
    });
  });
  Each<turns>([&](auto t) ARMCAL_INLINE {
    Each<stored>([&](auto j) ARMCAL_INLINE { r[j][t] = kept[t * stored + j]; });
    Each<rows>([&](auto i) ARMCAL_INLINE { x[t * stride + i] = own[t * rows + i]; });
  });
}
}  // namespace internal

// Folds all elements of `rows` rows, from the second one after the eliminated ones on, into `stored` stored rows. With
// more than one row `length` is odd.
template <int rows, int stored, int stride, class T>
ARMCAL_NOINLINE void FoldBlock(T* __restrict x, T* __restrict first, const T* __restrict rotation, int length) {
  constexpr int kTurns = rows * stored <= 10 ? 2 : 1;  // as many as the registers hold
  T c[2 * rows * stored];
  T* r[stored];
  internal::Each<2 * rows * stored>([&](auto k) ARMCAL_INLINE { c[k] = rotation[k]; });
  r[0] = first + stored;
  internal::Each<stored - 1>([&](auto j) ARMCAL_INLINE { r[j + 1] = r[j] + (length + stored - 2 - j); });
  x += (stored + 1) * stride;
  const T* const end = r[0] + (length - 1);
  const auto turns = [&](auto many) ARMCAL_INLINE {
    internal::FoldTurn<rows, stored, stride, many>(x, r, c);
    internal::Each<stored>([&](auto j) ARMCAL_INLINE { r[j] += many; });
    x += many * stride;
  };
  while (r[0] + (kTurns - 1) < end) turns(std::integral_constant<int, kTurns>{});
  if constexpr (rows == 1 && kTurns == 2)
    if (r[0] < end) turns(std::integral_constant<int, 1>{});
}

// The part of an elimination that goes row by row: all pivots, and the elements up to the first one after them. Row i
// begins at element first[i] - column if that is positive, else at 0. Changes the rows' weights [rows] to those of what
// remains. Fills in rotation [rows][stored][2]: x0 and s of Fold.
template <int stored, int stride, class T>
ARMCAL_NOINLINE void GivensCorner(T* d, T* first, T* __restrict x, int length, const std::uint8_t* begin, int column,
                                  int rows, T* __restrict weight, T* __restrict rotation) {
  using internal::Each;
  T diagonal[stored], corner[stored * stored];
  T* r[stored];
  r[0] = first;
  Each<stored - 1>([&](auto j) ARMCAL_INLINE { r[j + 1] = r[j] + (length + stored - 1 - j); });
  Each<stored>([&](auto j) ARMCAL_INLINE {
    diagonal[j] = d[j];
    Each<stored - j>([&](auto k) ARMCAL_INLINE { corner[j * stored + k] = r[j][k]; });
  });
  for (int i = 0; i < rows; ++i, ++x, rotation += 2 * stored) {
    T own[stored + 1], remaining = weight[i];
    Each<stored + 1>([&](auto k) ARMCAL_INLINE { own[k] = x[k * stride]; });
    const int skipped = begin[i] - column;
    Each<stored>([&](auto j) ARMCAL_INLINE {
      T x0 = T(0), s = T(0);
      if (j + 1 == stored || j >= skipped) {
        x0 = own[j];
        remaining = GivensPivot(diagonal[j], x0, remaining, s);
        Each<stored - j>([&](auto k)
                             ARMCAL_INLINE { internal::FoldElement(own[j + 1 + k], corner[j * stored + k], x0, s); });
      }
      rotation[2 * j] = x0;
      rotation[2 * j + 1] = s;
    });
    weight[i] = remaining;
    x[stored * stride] = own[stored];
  }
  Each<stored>([&](auto j) ARMCAL_INLINE {
    d[j] = diagonal[j];
    Each<stored - j>([&](auto k) ARMCAL_INLINE { r[j][k] = corner[j * stored + k]; });
  });
}

}  // namespace armcal::math
