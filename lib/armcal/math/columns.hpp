// math - inner loops of the filters: products of columns, Bierman's update, Givens rotations.
//
// A loop works on several rows of a sample and several columns of a factor at once. It loads and stores each element
// once for all of them: two rows and four columns take five or six instructions for an element (kPairCost) where one
// row and one column take ten. Each element sees the same operations in the same order as if the rows and the columns
// came one after the other, so the bits are the same. A multiplication and an addition are never fused. So the bits are
// the same on all machines, and on a Cortex-M4F the pair takes two cycles instead of three. Context: any.
#pragma once

#include <cstdint>
#include <utility>

#include "armcal/math/elementary.hpp"  // refuses -ffast-math, which would reorder the sums
#include "armcal/math/groups.hpp"

namespace armcal::math {

// Never inlined: one copy serves all callers of a firmware, and the callers keep their registers.
#ifdef __clang__
#define ARMCAL_NOINLINE __attribute__((noinline))
#else
#define ARMCAL_NOINLINE __attribute__((noinline, noclone))
#endif

// Instructions for one element of one row and one column, where a loop takes several of each. Four are arithmetic.
inline constexpr int kPairCost = kMovesGroups ? 5 : 6;

namespace internal {
struct BiermanElement {
  template <class T>
  ARMCAL_INLINE void operator()(T& gain, T& u, T v, T shift) const {
    const T before = u, sum = gain;
    u = before + sum * shift;
    gain = sum + before * v;
  }
};
struct FoldElement {
  template <class T>
  ARMCAL_INLINE void operator()(T& x, T& r, T x0, T s) const {
    const T before = r, rest = x - x0 * before;
    x = rest;
    r = before + s * rest;
  }
};
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

// Subtracts x0 times r from x, then adds s times what is left of x to r. Shapes: x, r [length]. This is a Givens
// rotation without square roots, and also a column of a rank-one sum. r changes by a small correction, so that little
// is lost to rounding.
template <class T>
void Fold(T* __restrict x, T* __restrict r, T x0, T s, int length) {
  for (int k = 0; k < length; ++k) internal::FoldElement()(x[k], r[k], x0, s);
}

namespace internal {
// `turns` elements of each row and of each column (or stored row). They are loaded before the first store: a core that
// issues in order (Cortex-M7) would otherwise wait for each element's chain before it starts the next one. For the same
// reason the pairs of a row and a stored row come in diagonals: pairs of one diagonal do not need each other.
template <class Element, int rows, int stored, int stride, int turns, class T>
ARMCAL_INLINE inline void BlockTurn(T* __restrict x, T** r, const T* c) {
  constexpr int kTogether = stride == rows ? turns : 1;  // turns whose elements of the rows lie side by side
  constexpr int kGroups = turns / kTogether, kOwn = kTogether * rows;
  constexpr int kOwnPlace = turns == 4 ? 12 : 16, kPlace = turns == 4 ? 16 : 24;
  T own[turns * rows], kept[turns * stored];
  Each<stored>([&](auto j) ARMCAL_INLINE { Load<turns, kPlace + j * turns>(r[j], kept + j * turns); });
  Each<kGroups>([&](auto g) ARMCAL_INLINE { Load<kOwn, kOwnPlace + g * kOwn>(x + g * stride, own + g * kOwn); });
  Each<rows + stored - 1>([&](auto diagonal) ARMCAL_INLINE {
    Each<rows>([&](auto i) ARMCAL_INLINE {
      constexpr int j = diagonal - i;
      if constexpr (0 <= j && j < stored) {
        constexpr int kAt = 2 * (i * stored + j);
        Each<turns>([&](auto t)
                        ARMCAL_INLINE { Element()(own[t * rows + i], kept[j * turns + t], c[kAt], c[kAt + 1]); });
      }
    });
  });
  Each<kGroups>([&](auto g) ARMCAL_INLINE { Store<kOwn, kOwnPlace + g * kOwn>(own + g * kOwn, x + g * stride); });
  Each<stored>([&](auto j) ARMCAL_INLINE { r[j] = Store<turns, kPlace + j * turns>(kept + j * turns, r[j]); });
}
// All elements: rows x, columns r [stored], `length` of each. c [rows][stored][2]: two numbers for each pair. If kEven,
// the length is even.
template <class Element, int rows, int stored, int stride, bool kEven, class T>
ARMCAL_INLINE inline void EachTurn(T* __restrict x, T** r, const T* c, int length) {
  constexpr int kPairs = rows * stored;  // as many turns as the registers hold
  constexpr int kTurns = kMovesGroups && kPairs <= 4 ? 4 : kPairs <= (kMovesGroups ? 8 : 10) ? 2 : 1;
  const T* const end = r[0] + length;
  const auto turns = [&](auto many) ARMCAL_INLINE {
    BlockTurn<Element, rows, stored, stride, many>(x, r, c);
    x += many * stride;
  };
  while (r[0] + (kTurns - 1) < end) turns(std::integral_constant<int, kTurns>{});
  if constexpr (kTurns == 4)
    if (r[0] + 1 < end) turns(std::integral_constant<int, 2>{});
  if constexpr (!kEven && kTurns > 1)
    if (r[0] < end) turns(std::integral_constant<int, 1>{});
}
}  // namespace internal

// sum + the sum of a[k] b[k] for k < length.
template <class T>
ARMCAL_NOINLINE T Dot(const T* __restrict a, const T* __restrict b, int length, T sum = T(0)) {
  const auto turns = [&](auto many) ARMCAL_INLINE {
    T left[many], right[many];
    internal::Load<many, 0>(a, left), internal::Load<many, 4>(b, right);
    internal::Each<many>([&](auto k) ARMCAL_INLINE { sum += left[k] * right[k]; });
    a += many, b += many;
  };
  const T* const end = a + length;
  while (a + 3 < end) turns(std::integral_constant<int, 4>{});
  while (a < end) turns(std::integral_constant<int, 1>{});
  return sum;
}

// Here several rows lie side by side: element k of row i is x[k * rows + i].

// Adds to sum [columns][rows] the products of `columns` columns with `rows` rows. Shapes: u [columns][length].
template <int rows, int columns, class T>
ARMCAL_NOINLINE void Dots(const T* __restrict x, const T* const* u, int length, T* __restrict sum) {
  using internal::Each;
  T s[columns * rows];
  const T* column[columns];
  Each<columns * rows>([&](auto k) ARMCAL_INLINE { s[k] = sum[k]; });
  Each<columns>([&](auto j) ARMCAL_INLINE { column[j] = u[j]; });
  internal::ByFours(length, [&](int) ARMCAL_INLINE {
    Each<rows>([&](auto i) ARMCAL_INLINE {
      const T own = x[i];
      Each<columns>([&](auto j) ARMCAL_INLINE { s[j * rows + i] += *column[j] * own; });
    });
    Each<columns>([&](auto j) ARMCAL_INLINE { ++column[j]; });
    x += rows;
  });
  Each<columns * rows>([&](auto k) ARMCAL_INLINE { sum[k] = s[k]; });
}

// Bierman's measurement update of `columns` columns by `rows` rows: u += gain shift and gain += u v, both with the old
// u and the old gain. Shapes: u [columns][length], gain `length` elements of each row, step [columns][rows][2]: v and
// shift.
template <int rows, int columns, class T>
ARMCAL_NOINLINE void BiermanBlock(T* __restrict gain, T* const* u, const T* __restrict step, int length) {
  using internal::Each;
  T c[2 * rows * columns];
  T* r[columns];
  Each<columns>([&](auto j) ARMCAL_INLINE {
    r[j] = u[j];
    Each<rows>([&](auto i) ARMCAL_INLINE {
      c[2 * (i * columns + j)] = step[2 * (j * rows + i)];
      c[2 * (i * columns + j) + 1] = step[2 * (j * rows + i) + 1];
    });
  });
  internal::EachTurn<internal::BiermanElement, rows, columns, rows, false>(gain, r, c, length);
}

// The same with `columns` columns r, one after the other. fold [columns][2]: x0 and s. Shapes: x [length], r
// [columns][length].
template <int columns, class T>
ARMCAL_NOINLINE void FoldColumns(T* __restrict x, T* const* r, const T* __restrict fold, int length) {
  T c[2 * columns];
  T* each[columns];
  internal::Load<2 * columns, 0>(fold, c);
  internal::Each<columns>([&](auto j) ARMCAL_INLINE { each[j] = r[j]; });
  internal::EachTurn<internal::FoldElement, 1, columns, 1, false>(x, each, c, length);
}

// Below: Givens rotations without square roots, which add a row to a unit upper triangle R. W. M. Gentleman, Least
// squares computations by Givens transformations without square roots, 1973. The triangle stands for the information R'
// diag(d) R. A row of zeros leaves every bit as it was.

// Adds weight x0^2 to d. Fills in s, the share of the remainder that Fold adds to the stored row. Returns the weight of
// the remainder.
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

// Below, "rows" are the new rows of a sample, and "stored rows" are rows of the triangle. One call adds a block of rows
// to several stored rows. Element k of row i is x[k * stride + i]. Each stored row takes the rows in their order, so
// the bits are the same as with one row at a time. But each element of a row is loaded once for all stored rows, and
// each element of a stored row once for all rows.
// The stored rows lie one after the other in memory: (1, r[0..]) for element 0, then (1, ...) for element 1, and so on.
// The 1 itself is not stored. Each stored row is one element shorter than the one before. All have d > 0. `length`: how
// many elements a row has after the eliminated ones.

// The rest of the elimination, after GivensCorner: folds `rows` rows into `stored` stored rows. GivensCorner has
// already done the first element after the eliminated ones; this does all others. If rows > 1, `length` must be odd,
// because the loop may take two elements at a time.
template <int rows, int stored, int stride, class T>
ARMCAL_NOINLINE void FoldBlock(T* __restrict x, T* __restrict first, const T* __restrict rotation, int length) {
  T c[2 * rows * stored];
  T* r[stored];
  internal::Load<2 * rows * stored, 0>(rotation, c);
  r[0] = first + stored;
  internal::Each<stored - 1>([&](auto j) ARMCAL_INLINE { r[j + 1] = r[j] + (length + stored - 2 - j); });
  internal::EachTurn<internal::FoldElement, rows, stored, stride, (rows > 1)>(x + (stored + 1) * stride, r, c,
                                                                              length - 1);
}

// The part of an elimination that takes the rows one by one: it computes all pivots, and changes the elements up to the
// first one after the pivots. x: the rows. d [stored], first: the stored rows. `column`: number of the first stored
// row, counted as in begin [rows]. Row i is zero before stored row begin[i] - column, so these stored rows are skipped,
// but never the last one. If the number is not positive, none is skipped. weight [rows]: on return the weights of the
// remainders. Fills in rotation [rows][stored][2] with x0 and s of Fold.
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
                             ARMCAL_INLINE { internal::FoldElement()(own[j + 1 + k], corner[j * stored + k], x0, s); });
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
