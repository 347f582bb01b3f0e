// physical - can this body exist, and its two sets of coordinates; knows one rigid body, no robot.
//
// Block of 10, the table's order: m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the frame's origin.
// Central block of 10: m, cx, cy, cz, and the same six about the centre of mass. SI units. T: any scalar.
// Context: background.
#pragma once

#include "armcal/math/elementary.hpp"

namespace armcal::physical {

// A pivot of the pseudo-inertia below this share of its diagonal counts as zero: some hundred float32 roundings.
inline constexpr float kPivotMargin = 1e-5f;

// True if the pseudo-inertia [[tr(I)/2 E - I, mc], [mc', m]] is positive definite: positive mass, and principal
// moments about the centre that are positive and obey the triangle inequality. P. M. Wensing, S. Kim, J.-J. Slotine,
// Linear matrix inequalities for physically consistent inertial parameter identification, 2018.
template <class T>
bool IsPhysical(const T* body) {
  const T half = (body[4] + body[7] + body[9]) * T(0.5f);
  // Elimination starts at the mass, so that what remains is about the centre.
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

// The same of a link: a block of 11, its body and after it the rotor inertia of its motor, which is not negative.
template <class T>
bool CanExist(const T* link) {
  return IsPhysical(link) && link[10] >= T(0);  // also false for NaN
}

// I += m (c'c E - c c') with m = sign x mass. Shapes: c [3], inertia [6].
template <class T>
void AddParallelAxis(T m, const T* c, T* inertia) {
  inertia[0] += m * (c[1] * c[1] + c[2] * c[2]);
  inertia[1] -= m * c[0] * c[1];
  inertia[2] -= m * c[0] * c[2];
  inertia[3] += m * (c[0] * c[0] + c[2] * c[2]);
  inertia[4] -= m * c[1] * c[2];
  inertia[5] += m * (c[0] * c[0] + c[1] * c[1]);
}

// The centre of a body without mass is its origin.
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
  // Inertia rows: against m the unit parallel axis term, against c_k its derivative.
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

}  // namespace armcal::physical
