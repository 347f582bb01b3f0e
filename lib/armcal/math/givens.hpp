// math - one row worked into a unit upper triangle by square-root-free Givens rotations; knows no filter.
//
// The triangle stands for the information R' diag(d) R. W. M. Gentleman, Least squares computations by Givens
// transformations without square roots, 1973. A row of zeros leaves every bit as it was. Context: any.
#pragma once

#include "armcal/math/columns.hpp"

namespace armcal::math {

// d takes x0 of the given weight; s: what the stored row takes of the remainder. Returns the remainder's weight.
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

// Eliminates x0, then what it leaves of x[0], of the row (x0, x) of the given weight against two stored rows with d >
// 0: (1, r1[0..length]) and after it (1, r2[0..length - 1]); length 0: against the first alone. Shapes: x, r1 [length +
// 1], r2 [length]; x is what remains of the row. Returns the weight of what remains.
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
