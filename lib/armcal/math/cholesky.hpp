// math - symmetric positive definite equations A x = b by Cholesky, one column a call; knows no filter.
//
// Packed by columns like ud.hpp, element (i, j), i <= j, at j (j + 1) / 2 + i; A = R' R, R upper triangular, in place.
// A caller that makes column j just before it is worked in needs no second matrix. Context: background.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::math {

// column [j + 1] of A -> of R, given the columns before it. False if A is not as positive definite as `least`: its
// pivot is then `least`, so that R' R is larger than A.
template <class T>
bool CholeskyColumn(const T* before, int j, T least, T* column) {
  T pivot = column[j];
  for (int i = 0; i < j; ++i) {
    T sum = column[i];
    for (int k = 0; k < i; ++k) sum -= before[k] * column[k];
    column[i] = sum / before[i];
    pivot -= column[i] * column[i];
    before += i + 1;
  }
  column[j] = Sqrt(Max(pivot, least));
  return pivot >= least;
}

// x = R'^-1 b and x = R^-1 b, in place. Shapes: r [n (n + 1) / 2], x [n].
template <int n, class T>
void SolveLower(const T* r, T* x) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= r[k] * x[k];
    x[i] /= r[i];
    r += i + 1;
  }
}
template <int n, class T>
void SolveUpper(const T* r, T* x) {
  for (int j = n - 1; j >= 0; --j) {
    const T* column = r + j * (j + 1) / 2;
    x[j] /= column[j];
    for (int i = 0; i < j; ++i) x[i] -= column[i] * x[j];
  }
}

}  // namespace armcal::math
