// physical - steps of a body in m, c, I about the centre, and the barrier that keeps it possible; knows one rigid body,
// no robot.
//
// In central coordinates the determinant of the pseudo-inertia is m det S, S = tr(I)/2 E - I the second moments about
// the centre: the barrier -logdet needs neither the centre nor a 4 x 4 matrix. A margin keeps S that far inside the
// cone of possible bodies. T: a scalar with a double's accuracy. Blocks of 10 as in physical.hpp. Context: background.
#pragma once

#include "armcal/physical/physical.hpp"

namespace armcal::physical {

// g' I, with I = c'c E - c c' of a unit mass, is c' theta c. g: of the six moments of inertia; theta: xx xy xz yy yz
// zz.
template <class T>
struct InertiaForm {
  T theta[6];

  explicit InertiaForm(const T* g)
      : theta{g[3] + g[5], T(-0.5f) * g[1], T(-0.5f) * g[2], g[0] + g[5], T(-0.5f) * g[4], g[0] + g[3]} {}
  void Times(const T* c, T* out) const {
    out[0] = theta[0] * c[0] + theta[1] * c[1] + theta[2] * c[2];
    out[1] = theta[1] * c[0] + theta[3] * c[1] + theta[4] * c[2];
    out[2] = theta[2] * c[0] + theta[4] * c[1] + theta[5] * c[2];
  }
};

// out [10] = J' g, J = d body / d central at m, c: the gradient in central coordinates of what has gradient g [10].
template <class T>
void PullBack(T m, const T* c, const T* g, T* out) {
  T turned[3];
  InertiaForm<T>(g + 4).Times(c, turned);
  out[0] = g[0];
  for (int i = 0; i < 3; ++i) {
    out[0] += c[i] * (g[1 + i] + turned[i]);
    out[1 + i] = m * (g[1 + i] + T(2) * turned[i]);
  }
  for (int i = 4; i < 10; ++i) out[i] = g[i];
}

// The body at central + J^-1 (a straight step of J move in m, m c, I about the origin). What is linear in those stays
// linear along a Move: torques and the pseudo-inertia. Coordinates of the inertia where `held` stay. Shapes: [10].
template <class T>
void Move(const T* central, const T* move, const bool* held, T* moved) {
  T bent[6] = {};
  const T mass = central[0] + move[0], share = math::Divide(central[0], mass);
  AddParallelAxis(central[0] * share, move + 1, bent);
  moved[0] = mass;
  for (int k = 1; k < 4; ++k) moved[k] = central[k] + share * move[k];
  for (int k = 4; k < 10; ++k) moved[k] = central[k] + (held[k] ? T(0) : move[k] - bent[k - 4]);
}

// S - margin E of a central block as xx xy xz yy yz zz.
template <class T>
void SecondMoments(const T* central, T margin, T* s) {
  const T half = (central[4] + central[7] + central[9]) * T(0.5f) - margin;
  for (int k = 0; k < 6; ++k) s[k] = -central[4 + k];
  for (const int k : {0, 3, 5}) s[k] += half;
}

// m det(S - margin E), by its pivots; zero unless all of them are positive.
template <class T>
T ConeDeterminant(const T* central, T margin) {
  T s[6];
  SecondMoments(central, margin, s);
  const T xy = math::Divide(s[1], s[0]), xz = math::Divide(s[2], s[0]);
  const T second = s[3] - xy * s[1], mixed = s[4] - xy * s[2];
  const T third = s[5] - xz * s[2] - math::Divide(mixed, second) * mixed;
  const bool inside = (central[0] > T(0)) & (s[0] > T(0)) & (second > T(0)) & (third > T(0));
  return math::Select(inside, central[0] * s[0] * second * third, T(0));
}

// Derivatives of -log ConeDeterminant by coordinate k of a Move: returns the first, column [10] gets the second. The
// body must be inside the cone.
template <class T>
T BarrierDerivatives(const T* central, T margin, int k, T* column) {
  for (int i = 0; i < 10; ++i) column[i] = T(0);
  if (k == 0) {
    const T inverse = T(1) / central[0];
    column[0] = inverse * inverse;
    return -inverse;
  }
  // Q = S^-1 by cofactors, full.
  T s[6], q[3][3];
  SecondMoments(central, margin, s);
  q[0][0] = s[3] * s[5] - s[4] * s[4];
  q[0][1] = s[2] * s[4] - s[1] * s[5];
  q[0][2] = s[1] * s[4] - s[2] * s[3];
  q[1][1] = s[0] * s[5] - s[2] * s[2];
  q[1][2] = s[1] * s[2] - s[0] * s[4];
  q[2][2] = s[0] * s[3] - s[1] * s[1];
  const T inverse = T(1) / (s[0] * q[0][0] + s[1] * q[0][1] + s[2] * q[0][2]);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) q[i][j] = q[j][i] = q[i][j] * inverse;

  if (k <= 3) {  // m c moves, and what S loses by it is of second order
    for (int i = 0; i < 3; ++i) column[1 + i] = T(2) * central[0] * q[k - 1][i];
    return T(0);
  }
  // d S / d I_a is E/2 - e_a e_a' on the diagonal, -(e_a e_b' + e_b e_a') beside it. r = Q dS/dI_k Q.
  constexpr int kRow[6] = {0, 0, 0, 1, 1, 2}, kColumn[6] = {0, 1, 2, 1, 2, 2};
  const auto trace = [&](const T(&m)[3][3], int a) {  // of m dS/dI_a, m symmetric
    const int i = kRow[a], j = kColumn[a];
    return i == j ? T(0.5f) * (m[0][0] + m[1][1] + m[2][2]) - m[i][i] : T(-2) * m[i][j];
  };
  const int a = kRow[k - 4], b = kColumn[k - 4];
  T r[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const T square = q[i][0] * q[0][j] + q[i][1] * q[1][j] + q[i][2] * q[2][j];
      r[i][j] = a == b ? T(0.5f) * square - q[i][a] * q[a][j] : -q[i][a] * q[b][j] - q[i][b] * q[a][j];
    }
  for (int other = 0; other < 6; ++other) column[4 + other] = trace(r, other);
  return -trace(q, k - 4);
}

}  // namespace armcal::physical
