// filter - an estimate x and its covariance U D U' in memory; knows positions, and what the prior says of columns.
#pragma once

#include "armcal/filter/order.hpp"
#include "armcal/math/columns.hpp"
#include "armcal/math/elementary.hpp"
#include "armcal/math/ud.hpp"

namespace armcal::filter {

// Where the numbers are: x, a row in work and its gain, [shape->size] each, then the factor's elements. What is called
// with one knows no layout: one copy serves all filters of a form. Context: background.
template <Form form>
struct Factor {
  const Shape<form>* shape;
  float* x;

  float* row() const { return x + shape->size; }
  float* gain() const { return x + 2 * shape->size; }
  float* element() const { return x + 3 * shape->size; }
  float* column(int p) const { return x + shape->Origin(p); }  // its element (i, p) at i
  float& d(int p) const { return column(p)[p]; }
};

// x = 0 and the prior's correlation: dense_ud of the dense columns, the others on their own if active. Slopes start as
// known: zero.
template <Form form>
ARMCAL_NOINLINE void StartAtPrior(Factor<form> f, const float* dense_ud, const std::uint32_t* active) {
  const auto& shape = *f.shape;
  for (float* k = f.x; k <= &f.d(shape.size - 1); ++k) *k = 0.0f;
  const auto* const at = shape.position;
  for (int k = 0; k < shape.states; ++k) f.d(at[k]) = math::Masked(1.0f, active[k]);
  for (int j = 0; j < shape.denses; ++j) {
    float* column = f.column(at[shape.fronts + j]);
    for (int i = 0; i <= j; ++i) column[at[shape.fronts + i]] = *dense_ud++;
  }
}

// Dense D below the floor is raised to it. Returns how many.
template <Form form>
ARMCAL_NOINLINE std::uint32_t HoldFloor(Factor<form> f, float link_floor, const std::uint32_t* active) {
  std::uint32_t held = 0;
  for (int k = f.shape->fronts; k < f.shape->states; ++k) {
    const float floor = math::Masked(link_floor, active[k]);
    float& d = f.d(f.shape->position[k]);
    held += d < floor;
    d = math::Max(d, floor);
  }
  return held;
}

// variance [size] += the parts of columns `next` on of the diagonal of P, as far as credit lasts; all columns from
// variance = 0 on give it. True: done.
template <Form form>
ARMCAL_NOINLINE bool AddDiagonal(Factor<form> f, float* variance, int& next, int& credit) {
  int p = next, left = credit;
  for (; p < f.shape->size && left > 0; ++p) {
    const float* column = f.column(p);
    const float weight = column[p];
    const int begin = f.shape->Begin(p);
    for (int i = begin; i < p; ++i) variance[i] += weight * column[i] * column[i];
    variance[p] += weight;
    left -= 8 + (p - begin) / 2;
  }
  credit = left;
  next = p;
  return p == f.shape->size;
}

}  // namespace armcal::filter
