// physical - converts the prior of the bodies to the prior of the base parameters, and base parameters to bodies.
//
// The base parameters are b = B phi, where phi are the parameters of the bodies and the matrix B is constant for a
// model (kMapBegin, kMapColumn, kMapValue). The prior of a body is Gaussian in (m, c, I about the centre, rotor
// inertia): phi ~ phi0 + J S xi with xi ~ N(0, 1), J = d(m, mc, Io) / d(m, c, Ic) at the mean, and S = diag(sd). In
// base coordinates, b - b0 = W xi with W = B J S. W is factored as W = U w~, where U is unit upper triangular and w~
// w~' = D is diagonal. Then the Kalman read-out of the bodies,
//   phi = phi0 + P0 B' (B P0 B')^-1 (b - b0), is phi0 + J S w~' D^-1 U^-1 (b - b0).
// T: float on the target, double on a PC. Context: background.
#pragma once

#include "armcal/math/symmetric.hpp"
#include "armcal/model/contract.hpp"
#include "armcal/physical/body.hpp"

namespace armcal::physical {

template <class Model, class T>
struct RigidPrior {
  static constexpr int kBodies = Model::kBodyParameters;
  T mean[kBodies];                    // phi0, blocks of 11 per link
  T sd[kBodies];                      // 0: known exactly
  T w[Model::kRigid * kBodies];       // W, then w~
  T ud[math::UdSize(Model::kRigid)];  // base covariance B P0 B'
};

// base [kRigid] = B body [kBodyParameters].
template <class Model, class T>
void MapBodies(const T* body, T* base) {
  for (int r = 0; r < Model::kRigid; ++r) {
    T sum = T(0);
    for (int e = Model::kMapBegin[r]; e < Model::kMapBegin[r + 1]; ++e)
      sum += T(Model::kMapValue[e]) * body[Model::kMapColumn[e]];
    base[r] = sum;
  }
}

// J of one link at the mean `body`. Shape: jacobian [100].
template <class T>
void LinkJacobian(const T* body, T* jacobian) {
  T centre[3];
  for (int i = 0; i < 3; ++i) centre[i] = math::Divide(body[1 + i], body[0]);
  BodyJacobian(body[0], centre, jacobian);
}

// The columns of W = B J S of one link, from mean and sd.
template <class Model, class T>
void SpreadLink(RigidPrior<Model, T>& prior, int link) {
  constexpr int kBodies = Model::kBodyParameters, kBlock = model::kBodyBlock;
  T jacobian[100];
  LinkJacobian(prior.mean + link * kBlock, jacobian);
  const T* sd = prior.sd + link * kBlock;
  for (int r = 0; r < Model::kRigid; ++r) {
    T* w = prior.w + r * kBodies + link * kBlock;
    for (int k = 0; k < kBlock; ++k) w[k] = T(0);
    for (int e = Model::kMapBegin[r]; e < Model::kMapBegin[r + 1]; ++e) {
      const int parameter = Model::kMapColumn[e] - link * kBlock;
      if (parameter < 0 || parameter >= kBlock) continue;
      const T value = T(Model::kMapValue[e]);
      if (parameter == model::kRotor) w[model::kRotor] += value * sd[model::kRotor];
      else
        for (int k = 0; k < 10; ++k) w[k] += value * jacobian[parameter * 10 + k] * sd[k];
    }
  }
}
// The same of all links.
template <class Model, class T>
void SpreadPrior(RigidPrior<Model, T>& prior) {
  for (int link = 0; link < Model::kJoints; ++link) SpreadLink<Model>(prior, link);
}

// After SpreadPrior: ud = U D U', and w becomes w~. Takes about kRigid^2 kBodyParameters multiplications in all.
template <class Model, class T>
void FactorPrior(RigidPrior<Model, T>& prior) {
  math::UdFromSquareRoot<Model::kRigid, Model::kBodyParameters>(prior.w, prior.ud);
}

// After FactorPrior: fills in body [kBodyParameters] from base [kRigid] = b. Directions that the base parameters do not
// determine follow the prior's correlation. The map is linear, so after a large step a body need not be possible.
template <class Model, class T>
void ReadBodies(const RigidPrior<Model, T>& prior, const T* base, T* body) {
  constexpr int kBodies = Model::kBodyParameters, kBlock = model::kBodyBlock;
  T u[Model::kRigid];
  MapBodies<Model>(prior.mean, u);
  for (int r = 0; r < Model::kRigid; ++r) u[r] = base[r] - u[r];
  math::UdSolveUpper<Model::kRigid>(prior.ud, u);
  for (int r = 0; r < Model::kRigid; ++r) u[r] = math::Divide(u[r], prior.ud[math::UdIndex(r, r)]);
  for (int link = 0; link < Model::kJoints; ++link) {
    T step[kBlock], jacobian[100];
    for (int k = 0; k < kBlock; ++k) {
      const int column = link * kBlock + k;
      T xi = T(0);
      for (int r = 0; r < Model::kRigid; ++r) xi += prior.w[r * kBodies + column] * u[r];
      step[k] = prior.sd[column] * xi;
    }
    const T* mean = prior.mean + link * kBlock;
    T* out = body + link * kBlock;
    LinkJacobian(mean, jacobian);
    for (int i = 0; i < 10; ++i) {
      out[i] = mean[i];
      for (int k = 0; k < 10; ++k) out[i] += jacobian[i * 10 + k] * step[k];
    }
    out[model::kRotor] = mean[model::kRotor] + step[model::kRotor];
  }
}

}  // namespace armcal::physical
