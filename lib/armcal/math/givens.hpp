// math - one row worked into a unit upper triangle by square-root-free Givens rotations; knows no filter.
//
// The triangle stands for the information R' diag(d) R. W. M. Gentleman, Least squares computations by Givens
// transformations without square roots, 1973. A row of zeros leaves every bit as it was. Context: any.
#pragma once

namespace armcal::math {

// Eliminates x0 of the row (x0, x) of the given weight against the stored row (1, r) with d > 0.
// Shapes: x, r [length]; x0 is read before, x is what remains of the row. Returns the weight of what remains.
// The stored row moves by a correction, so that its increments are not lost beside its value.
template <class T>
T GivensRow(T& d, T* __restrict r, T x0, T* __restrict x, int length, T weight) {
  const T wx = weight * x0;
  const T next = d + wx * x0;
  const T inverse = T(1) / next;
  const T s = wx * inverse;
  const T remaining = weight * (d * inverse);
  for (int k = 0; k < length; ++k) {
    const T rest = x[k] - x0 * r[k];
    r[k] += s * rest;
    x[k] = rest;
  }
  d = next;
  return remaining;
}

}  // namespace armcal::math
