// estimator - a planar two-link arm written by hand, as a generated model would be; the tests' model.
//
// Axes along z, gravity along -y, link lengths a1. Columns by hand from Lagrange's equations:
//   front, joint 1: Fc1 sgn(qd1), Fv1 qd1, To1; joint 2: Fc2, Fv2, To2, Fs2 sgn(qd2) exp(-(qd2/vs2)^2)
//   rigid: ZZ1 + rotor1 + a1^2 m2, MX1 + a1 m2, MY1, MX2, MY2, ZZ2, rotor2
//   dense effect: coupling friction k (qd1 - qd2) on joint 1, its negative on joint 2
#pragma once

#include "armcal/math/elementary.hpp"
#include "armcal/model/contract.hpp"

namespace armcal::test {

struct TwoLink {
  static constexpr int kJoints = 2, kFront = 7, kRigid = 7, kDense = 8, kColumns = 15, kNonlinear = 1;
  static constexpr int kFrontBegin[3] = {0, 3, 7};
  static constexpr int kRowBegin[2] = {0, 3};
  static constexpr int kBodyParameters = 22, kParameters = 22 + 7 + 1 + 1;
  static constexpr std::uint32_t kSchema = 0x2D2D0001u;
  static constexpr int kSampleTicks = 8;
  static constexpr float kTickRate_Hz = 1000.0f;
  static constexpr float kForgetting[4] = {1, 1, 1, 1};
  static constexpr float kA1 = 0.5f, kGravity = 9.81f;

  static constexpr model::ParameterState kOn = model::ParameterState::kEstimated;
  static constexpr model::ParameterState kOff = model::ParameterState::kStandby;
  static constexpr float kBig = 3e38f;
  // m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the link origin, rotor: sd of (m, c, I about the centre).
  static constexpr model::ParameterInfo kInfo[kParameters] = {
      {"m1", "kg", 10.0f, 2.0f, -kBig, kBig, 0, kOn, 0},
      {"mx1", "kg*m", 2.0f, 0.04f, -kBig, kBig, 0, kOn, 0},
      {"my1", "kg*m", 0.2f, 0.01f, -kBig, kBig, 0, kOn, 0},
      {"mz1", "kg*m", 0.5f, 0.01f, -kBig, kBig, 0, kOn, 0},
      {"Ixx1", "kg*m^2", 0.129f, 0.02f, -kBig, kBig, 0, kOn, 0},
      {"Ixy1", "kg*m^2", -0.03f, 0.005f, -kBig, kBig, 0, kOn, 0},
      {"Ixz1", "kg*m^2", -0.1f, 0.005f, -kBig, kBig, 0, kOn, 0},
      {"Iyy1", "kg*m^2", 0.725f, 0.06f, -kBig, kBig, 0, kOn, 0},
      {"Iyz1", "kg*m^2", -0.01f, 0.005f, -kBig, kBig, 0, kOn, 0},
      {"Izz1", "kg*m^2", 0.704f, 0.06f, -kBig, kBig, 0, kOn, 0},
      {"rotor1", "kg*m^2", 0.8f, 0.1f, -kBig, kBig, 0, kOn, 0},
      {"m2", "kg", 5.0f, 1.0f, -kBig, kBig, 0, kOn, 0},
      {"mx2", "kg*m", 1.0f, 0.04f, -kBig, kBig, 0, kOn, 0},
      {"my2", "kg*m", -0.1f, 0.01f, -kBig, kBig, 0, kOn, 0},
      {"mz2", "kg*m", 0.05f, 0.01f, -kBig, kBig, 0, kOn, 0},
      {"Ixx2", "kg*m^2", 0.0325f, 0.006f, -kBig, kBig, 0, kOn, 0},
      {"Ixy2", "kg*m^2", 0.025f, 0.003f, -kBig, kBig, 0, kOn, 0},
      {"Ixz2", "kg*m^2", -0.01f, 0.003f, -kBig, kBig, 0, kOn, 0},
      {"Iyy2", "kg*m^2", 0.2505f, 0.02f, -kBig, kBig, 0, kOn, 0},
      {"Iyz2", "kg*m^2", 0.001f, 0.003f, -kBig, kBig, 0, kOn, 0},
      {"Izz2", "kg*m^2", 0.252f, 0.02f, -kBig, kBig, 0, kOn, 0},
      {"rotor2", "kg*m^2", 0.3f, 0.06f, -kBig, kBig, 0, kOn, 0},
      {"Fc1", "N*m", 8.0f, 4.0f, 0, kBig, 1e-6f, kOn, 1},
      {"Fv1", "N*m*s/rad", 5.0f, 2.5f, 0, kBig, 1e-6f, kOn, 1},
      {"To1", "N*m", 0.0f, 2.0f, -kBig, kBig, 0, kOff, 2},
      {"Fc2", "N*m", 4.0f, 2.0f, 0, kBig, 1e-6f, kOn, 1},
      {"Fv2", "N*m*s/rad", 2.0f, 1.0f, 0, kBig, 1e-6f, kOn, 1},
      {"To2", "N*m", 0.0f, 1.0f, -kBig, kBig, 0, kOff, 2},
      {"Fs2", "N*m", 0.0f, 1.0f, 0, kBig, 0, kOff, 2},
      {"coupling", "N*m*s/rad", 0.0f, 1.0f, -kBig, kBig, 0, kOff, 2},
      {"vs2", "rad/s", 0.1f, 0.05f, 0.01f, 1.0f, 0, kOn, 2},
  };
  static constexpr model::AxisInfo kAxes[kJoints] = {
      {6.2831853f / (65536.0f * 100.0f), 1000, 0.02f, 0.5f, 0.01f, 200.0f},
      {-6.2831853f / (65536.0f * 80.0f), -500, 0.01f, 0.3f, 0.01f, 80.0f}};
  static constexpr float kMotorToJoint[4] = {1, 0, 0, 1};
  static constexpr float kMotorTorqueToJoint[4] = {1, 0, 0, 1};
  static constexpr int kMapBegin[kRigid + 1] = {0, 3, 5, 6, 7, 8, 9, 10};
  static constexpr int kMapColumn[10] = {9, 10, 11, 1, 11, 2, 12, 13, 20, 21};
  static constexpr float kMapValue[10] = {1, 1, kA1* kA1, 1, kA1, 1, 1, 1, 1, 1};

  static constexpr int kStates = 0;
  static constexpr int kSensitivities = 0;
  static constexpr int kReadyState[kJoints] = {-1, -1};

  template <class T>
  static void InitialState(const model::ModelInput<T, 2>&, const T*, const T*, T*) {}

  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T*, const T* eta, const T*, T*, T* front, T* dense) {
    const T a1 = T(kA1), g = T(kGravity);
    const T angle[3] = {x.q[0], x.q[1], x.q[0] + x.q[1]};
    T s[3], c[3];
    math::SinCosBlock<3>(angle, s, c);
    const T sum = x.qdd[0] + x.qdd[1], twice = sum + x.qdd[0];
    const T coriolis = T(2) * x.qd[0] * x.qd[1] + x.qd[1] * x.qd[1], centrifugal = x.qd[0] * x.qd[0];
    T* r0 = dense;
    T* r1 = dense + kDense;
    r0[0] = x.qdd[0];
    r0[1] = g * c[0];
    r0[2] = -g * s[0];
    r0[3] = a1 * (c[1] * twice - s[1] * coriolis) + g * c[2];
    r0[4] = -a1 * (s[1] * twice + c[1] * coriolis) - g * s[2];
    r0[5] = sum;
    r0[6] = T(0);
    r0[7] = x.qd[0] - x.qd[1];
    r1[0] = r1[1] = r1[2] = T(0);
    r1[3] = a1 * (c[1] * x.qdd[0] + s[1] * centrifugal) + g * c[2];
    r1[4] = a1 * (c[1] * centrifugal - s[1] * x.qdd[0]) - g * s[2];
    r1[5] = sum;
    r1[6] = x.qdd[1];
    r1[7] = x.qd[1] - x.qd[0];
    const T ratio = x.qd[1] / eta[0];
    front[0] = math::Sign(x.qd[0]);
    front[1] = x.qd[0];
    front[2] = T(1);
    front[3] = math::Sign(x.qd[1]);
    front[4] = x.qd[1];
    front[5] = T(1);
    front[6] = front[3] * math::Exp(-ratio * ratio);
  }

  // d tau2 / d vs2 by hand; p = parameters in filter coordinates.
  template <class T>
  static void Jacobian(const model::ModelInput<T, 2>& x, const T*, const T* eta, const T* p, const T*, T*,
                       T* jacobian) {
    const T ratio = x.qd[1] / eta[0];
    jacobian[0] = T(0);
    jacobian[1] = p[6] * math::Sign(x.qd[1]) * math::Exp(-ratio * ratio) * T(2) * ratio * ratio / eta[0];
  }
};

// The Coulomb column of joint 2 becomes a counter: 0, 1, 2 ... samples since the start. Row 2 is ready once it is
// past 3. A state that is fed by the sample's acceleration shows what a sample that is not finite does.
struct CountingTwoLink : TwoLink {
  static constexpr int kStates = 3;
  static constexpr int kReadyState[kJoints] = {-1, 1};
  template <class T>
  static void InitialState(const model::ModelInput<T, 2>& x, const T*, const T*, T* state) {
    state[0] = state[1] = T(0);
    state[2] = x.qdd[1];
  }
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    TwoLink::Regressor(x, committed, eta, state, next, front, dense);
    front[3] = state[0];
    next[0] = state[0] + T(1);
    next[1] = state[0] > T(3) ? T(1) : T(0);
    next[2] = x.qdd[1];
  }
};

}  // namespace armcal::test
