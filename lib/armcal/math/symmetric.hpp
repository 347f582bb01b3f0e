// math - symmetric matrices, packed, and their factors U D U' and R' R.
//
// Packed by columns: element (i, j) with i <= j is number j (j + 1) / 2 + i, and the size is n (n + 1) / 2. P = U D U'
// with a unit upper triangular U; the diagonal of the packed factor holds D. Shape of ud in all functions: [UdSize(n)].
// Every kernel takes the same instructions whatever the numbers are, and allocates nothing. filter/factor.hpp has what
// rows and noise do to a filter's factor, in slices. Context: any.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::math {

constexpr int UdSize(int n) { return n * (n + 1) / 2; }
constexpr int UdIndex(int i, int j) { return j * (j + 1) / 2 + i; }

// P + c a a', c >= 0 (W. S. Agee, R. H. Turner, 1972). Shapes: a [n], overwritten.
template <int n, class T>
void UdAdd(T* __restrict ud, T c, T* __restrict a) {
  for (int j = n - 1; j >= 0; --j) {
    T* column = ud + UdIndex(0, j);
    const T old = column[j];
    const T now = old + c * a[j] * a[j];
    const bool tiny = !(now > T(1e-30f));
    const T inverse = T(1) / Select(tiny, T(1), now);
    const T step = Select(tiny, T(0), c * a[j] * inverse);
    for (int i = 0; i < j; ++i) {
      a[i] -= a[j] * column[i];
      column[i] += step * a[i];
    }
    column[j] = now;
    c *= Select(tiny, T(1), old * inverse);
  }
}

// P = W W' = U D U' by modified weighted Gram-Schmidt (Thornton). Shapes: w [n x m] row-major, overwritten by w~ with W
// = U w~ and w~ w~' = D; ud [UdSize(n)]. If at most 1e-10 of a row's squared length is left after the rows below it are
// subtracted, its D is 0. Call Begin, then Step until it returns true. One call works on `pairs` pairs of rows. There
// are n (n + 1) / 2 pairs, because a row with itself counts as one.
template <int n, int m, class T>
class UdOfSquareRoot {
 public:
  void Begin(T* w, T* ud) {
    w_ = w;
    ud_ = ud;
    for (int j = 0; j < n; ++j) before_[j] = Square(w + j * m);
    j_ = i_ = n - 1;
  }
  bool Step(int pairs) {
    for (; pairs > 0 && j_ >= 0; --pairs) {
      if (i_ == j_) Pivot();
      else Reduce(w_ + i_ * m, w_ + j_ * m, ud_[UdIndex(i_, j_)]);
      if (--i_ < 0) i_ = --j_;
    }
    return j_ < 0;
  }

 private:
  static T Square(const T* row) {
    T sum = T(0);
    for (int k = 0; k < m; ++k) sum += row[k] * row[k];
    return sum;
  }
  void Pivot() {
    const T d = Square(w_ + j_ * m);
    const bool none = !(d > T(1e-10f) * before_[j_]);
    inverse_ = Select(none, T(0), T(1) / Select(none, T(1), d));
    ud_[UdIndex(j_, j_)] = Select(none, T(0), d);
  }
  void Reduce(T* wi, const T* wj, T& u) const {
    T dot = T(0);
    for (int k = 0; k < m; ++k) dot += wi[k] * wj[k];
    u = dot * inverse_;
    for (int k = 0; k < m; ++k) wi[k] -= u * wj[k];
  }

  T* w_ = nullptr;
  T* ud_ = nullptr;
  T before_[n] = {};  // squares of the rows at the beginning
  T inverse_ = T(0);  // of D of row j_
  int j_ = -1, i_ = -1;
};
// The same at once.
template <int n, int m, class T>
void UdFromSquareRoot(T* w, T* ud) {
  UdOfSquareRoot<n, m, T> factor;
  factor.Begin(w, ud);
  (void)factor.Step(UdSize(n));
}

// diagonal [n] of P.
template <int n, class T>
void UdDiagonal(const T* ud, T* diagonal) {
  for (int i = 0; i < n; ++i) diagonal[i] = ud[UdIndex(i, i)];
  for (int j = 1; j < n; ++j) {
    const T* column = ud + UdIndex(0, j);
    for (int i = 0; i < j; ++i) diagonal[i] += column[j] * column[i] * column[i];
  }
}

// Scales P to S P S: U_ij s_i / s_j, D_j s_j^2, with inverse [n] = 1 / s (0 where s = 0: the column becomes zero).
template <int n, class T>
void UdScale(T* ud, const T* s, const T* inverse) {
  for (int j = 0; j < n; ++j) {
    T* column = ud + UdIndex(0, j);
    for (int i = 0; i < j; ++i) column[i] *= s[i] * inverse[j];
    column[j] *= s[j] * s[j];
  }
}

// x [n] = U^-1 b, in place.
template <int n, class T>
void UdSolveUpper(const T* ud, T* x) {
  for (int j = n - 1; j >= 0; --j)
    for (int i = 0; i < j; ++i) x[i] -= ud[UdIndex(i, j)] * x[j];
}

// A = R' R with R upper triangular (Cholesky), in place and one column a call. A caller that makes column j of A just
// before this call needs no second matrix. Turns column [j + 1] of A into that of R; `before` are R's columns before
// it. False if the pivot would be smaller than `least`: the pivot is then `least`, so that R' R is larger than A.
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

// x = R'^-1 b, and x = R^-1 b, in place. Shapes: r [n (n + 1) / 2], x [n].
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
