// physical - one rigid body: can it exist, its two sets of coordinates, and the barrier that keeps it possible.
//
// Block of 10, the table's order: m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the frame's origin.
// Central block of 10: m, cx, cy, cz, and the same six about the centre of mass. SI units. T: any scalar; the barrier
// needs one with the accuracy of a double. Context: background.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::physical {

// A pivot of the pseudo-inertia that is below this share of its diagonal counts as zero: some hundred float32
// roundings.
inline constexpr float kPivotMargin = 1e-5f;

// Returns true if the pseudo-inertia [[tr(I)/2 E - I, mc], [mc', m]] of body [10] is positive definite: positive mass,
// and principal moments about the centre that are positive and obey the triangle inequality. P. M. Wensing, S. Kim,
// J.-J. Slotine, Linear matrix inequalities for physically consistent inertial parameter identification, 2018.
template <class T>
bool IsPhysical(const T* body) {
  const T half = (body[4] + body[7] + body[9]) * T(0.5f);
  // Elimination starts at the mass, so that the remaining matrix is about the centre.
  T a[4][4] = {{body[0], body[1], body[2], body[3]},
               {body[1], half - body[4], -body[5], -body[6]},
               {body[2], -body[5], half - body[7], -body[8]},
               {body[3], -body[6], -body[8], half - body[9]}};
  bool good = true;
  for (int p = 0; p < 4; ++p) {
    const T diagonal = p == 0 ? a[0][0] : half - body[p == 1 ? 4 : p == 2 ? 7 : 9];
    good &= a[p][p] > T(0) && a[p][p] > T(kPivotMargin) * diagonal;  // also false for NaN
    const T inverse = math::Divide(T(1), a[p][p]);
    for (int i = p + 1; i < 4; ++i)
      for (int j = p + 1; j < 4; ++j) a[i][j] -= a[i][p] * inverse * a[p][j];
  }
  return good;
}

// The same for link [11], which is a body and after it the rotor inertia of the motor. Both must be possible; the rotor
// inertia may be zero.
template <class T>
bool CanExist(const T* link) {
  return IsPhysical(link) && link[10] >= T(0);  // also false for NaN
}

// I += m (c'c E - c c'), with m = mass or m = -mass. Shapes: c [3], inertia [6].
template <class T>
void AddParallelAxis(T m, const T* c, T* inertia) {
  inertia[0] += m * (c[1] * c[1] + c[2] * c[2]);
  inertia[1] -= m * c[0] * c[1];
  inertia[2] -= m * c[0] * c[2];
  inertia[3] += m * (c[0] * c[0] + c[2] * c[2]);
  inertia[4] -= m * c[1] * c[2];
  inertia[5] += m * (c[0] * c[0] + c[1] * c[1]);
}

// Block -> central block, and back. Shapes: [10]. A body without mass has its centre at the origin.
template <class T>
void ToCentral(const T* body, T* central) {
  central[0] = body[0];
  for (int i = 0; i < 3; ++i) central[1 + i] = math::Divide(body[1 + i], body[0]);
  for (int i = 4; i < 10; ++i) central[i] = body[i];
  AddParallelAxis(-body[0], central + 1, central + 4);
}

template <class T>
void FromCentral(const T* central, T* body) {
  body[0] = central[0];
  for (int i = 0; i < 3; ++i) body[1 + i] = central[0] * central[1 + i];
  for (int i = 4; i < 10; ++i) body[i] = central[i];
  AddParallelAxis(central[0], central + 1, body + 4);
}

// d body / d central at m, c [3]. Shape: jacobian [10 x 10] row-major.
template <class T>
void BodyJacobian(T m, const T* c, T* jacobian) {
  for (int k = 0; k < 100; ++k) jacobian[k] = T(k % 11 == 0 ? 1.0f : 0.0f);
  for (int i = 0; i < 3; ++i) {
    jacobian[(1 + i) * 10] = c[i];
    jacobian[(1 + i) * 11] = m;
  }
  // The rows of the inertia: the derivative by m is the parallel axis term of a unit mass, then follow those by c_k.
  T by_mass[6] = {};
  AddParallelAxis(T(1), c, by_mass);
  const T twice = T(2) * m;
  const T by_center[6][3] = {{T(0), twice * c[1], twice * c[2]}, {-m * c[1], -m * c[0], T(0)},
                             {-m * c[2], T(0), -m * c[0]},       {twice * c[0], T(0), twice * c[2]},
                             {T(0), -m * c[2], -m * c[1]},       {twice * c[0], twice * c[1], T(0)}};
  for (int r = 0; r < 6; ++r) {
    jacobian[(4 + r) * 10] = by_mass[r];
    for (int k = 0; k < 3; ++k) jacobian[(4 + r) * 10 + 1 + k] = by_center[r][k];
  }
}

// The barrier is -log det of the pseudo-inertia. In central coordinates this determinant is m det S, where S = tr(I)/2
// E - I holds the second moments about the centre. So the barrier needs neither the centre nor a 4 x 4 matrix. The code
// uses S - margin E instead of S, so that the result keeps a distance from bodies that cannot exist.

// For a unit mass, g' I with I = c'c E - c c' is the quadratic form c' theta c. g belongs to the six moments of
// inertia; theta is xx xy xz yy yz zz.
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

// out [10] = J' g, with J = d body / d central at m, c. A function with gradient g [10] by the block has gradient `out`
// by the central block.
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

// Moves a body on a line that is straight in m, m c and I about the origin, by the step J move (J = d body / d
// central). Torques and the pseudo-inertia are linear in those, so they are linear along the line. Coordinates of the
// inertia for which `held` is true do not change. Shapes: [10].
template <class T>
void Move(const T* central, const T* move, const bool* held, T* moved) {
  T bent[6] = {};
  const T mass = central[0] + move[0], share = math::Divide(central[0], mass);
  AddParallelAxis(central[0] * share, move + 1, bent);
  moved[0] = mass;
  for (int k = 1; k < 4; ++k) moved[k] = central[k] + share * move[k];
  for (int k = 4; k < 10; ++k) moved[k] = central[k] + (held[k] ? T(0) : move[k] - bent[k - 4]);
}

// s [6] = S - margin E of a central block [10], as xx xy xz yy yz zz.
template <class T>
void SecondMoments(const T* central, T margin, T* s) {
  const T half = (central[4] + central[7] + central[9]) * T(0.5f) - margin;
  for (int k = 0; k < 6; ++k) s[k] = -central[4 + k];
  for (const int k : {0, 3, 5}) s[k] += half;
}

// m det(S - margin E) of a central block [10], by its pivots. Zero unless all pivots are positive.
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

// Derivatives of -log ConeDeterminant by coordinate k of a Move. Returns the first, and fills in column [10] with the
// second. The body must be inside the cone.
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

  if (k <= 3) {  // m c moves, which changes S only to second order
    for (int i = 0; i < 3; ++i) column[1 + i] = T(2) * central[0] * q[k - 1][i];
    return T(0);
  }
  // d S / d I_a is E/2 - e_a e_a' for a moment on the diagonal, and -(e_a e_b' + e_b e_a') for another one.
  // r = Q dS/dI_k Q.
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
