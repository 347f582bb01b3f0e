// physical - where a read-out stands: the bodies of all links, and what prior and barrier say there; knows no data.
#pragma once

#include "armcal/physical/central.hpp"
#include "armcal/physical/map_problem.hpp"

namespace armcal::physical {

// Free coordinates u: [(t - t0) / sd of each body parameter, dense effects in prior units].
template <class Layout, class T>
struct MapPoint {
  T u[Layout::kBodyParameters + Layout::kDense - Layout::kRigid] = {};
  T central[Layout::kBodyParameters] = {};  // t: m, c, I about the centre, rotor
  T body[Layout::kBodyParameters] = {};     // about the link origins
};

template <class Layout, class T>
class MapArm {
 public:
  static constexpr int kBodies = Layout::kBodyParameters, kLinks = Layout::kJoints, kBlock = kBodies / kLinks;
  static constexpr int kRotor = kBlock - 1, kFree = kBodies + Layout::kDense - Layout::kRigid;
  // Of the trace of S about the link origin: twice what IsPhysical asks for, so that a table in float32 passes it.
  static constexpr T kMargin = T(2) * T(kPivotMargin);
  using Point = MapPoint<Layout, T>;
  static_assert(kBlock == 11, "a link has ten parameters about its origin, and a rotor inertia");

  // False: a body of the prior cannot exist, or a rotor inertia is zero and uncertain. A body that stands near the
  // border gets a smaller margin.
  bool Start(const MapPrior<Layout>& prior) {
    prior_ = prior;
    bool inside = true;
    for (int link = 0; link < kLinks; ++link) {
      const float* body = prior.body + link * kBlock;
      T mean[kBlock], central[kBlock];
      for (int k = 0; k < kBlock; ++k) mean[k] = T(body[k]);
      ToCentral(mean, central);
      T margin = kMargin * (mean[4] + mean[7] + mean[9]) * T(0.5);
      for (int halved = 0; halved < 10; ++halved)
        margin *= ConeDeterminant(central, T(2) * margin) > T(0) ? T(1) : T(0.5);
      margin_[link] = margin;
      const bool turns = body[kRotor] > 0.0f || !(sd(link * kBlock + kRotor) > T(0));
      inside &= turns && IsPhysical(body) && ConeDeterminant(central, margin) > T(0);
    }
    return inside;
  }
  const MapPrior<Layout>& prior() const { return prior_; }
  T sd(int k) const { return k < kBodies ? T(prior_.body_sd[k]) : T(1); }

  // point.u -> bodies.
  void Place(Point& point) const {
    for (int link = 0; link < kLinks; ++link) {
      T mean[kBlock];
      for (int k = 0; k < kBlock; ++k) mean[k] = T(prior_.body[link * kBlock + k]);
      T* central = point.central + link * kBlock;
      ToCentral(mean, central);
      central[kRotor] = mean[kRotor];
      for (int k = 0; k < kBlock; ++k) central[k] += sd(link * kBlock + k) * point.u[link * kBlock + k];
    }
    ToOrigins(point);
  }

  // to = from + share of `step` [kFree] in u, straight in the bodies about their origins (see Move).
  void Step(const Point& from, T share, const T* step, Point& to) const {
    for (int link = 0; link < kLinks; ++link) {
      const int at = link * kBlock;
      T move[kBlock];
      bool held[kBlock];
      for (int k = 0; k < kBlock; ++k) move[k] = share * sd(at + k) * step[at + k], held[k] = !(sd(at + k) > T(0));
      Move(from.central + at, move, held, to.central + at);
      to.central[at + kRotor] = from.central[at + kRotor] + move[kRotor];
    }
    for (int k = 0; k < kFree; ++k)
      to.u[k] = from.u[k] + (k < kBodies ? math::Divide(to.central[k] - from.central[k], sd(k)) : share * step[k]);
    ToOrigins(to);
  }

  // sum += change of -logdet (of the rotors, -log) between two points. False: `to` is outside the cone.
  bool AddBarrierChange(const Point& from, const Point& to, T& sum) const {
    bool inside = true;
    for (int link = 0; link < kLinks; ++link) {
      const int at = link * kBlock, rotor = at + kRotor;
      const T margin = margin_[link];
      T now = ConeDeterminant(to.central + at, margin), before = ConeDeterminant(from.central + at, margin);
      if (sd(rotor) > T(0)) now *= to.central[rotor], before *= from.central[rotor];
      inside &= now > T(0) && IsPhysical(to.body + at);
      sum -= math::Log(math::Divide(now, before));
    }
    return inside;
  }

  // g over [bodies about the link origins, effects] -> over u, for the rows of the first `links` links, in place.
  void ToFree(const Point& point, int links, T* g) const {
    for (int link = 0; link < links; ++link) {
      const T* central = point.central + link * kBlock;
      T* at = g + link * kBlock;
      T pulled[10];
      PullBack(central[0], central + 1, at, pulled);
      for (int k = 0; k < 10; ++k) at[k] = pulled[k];
      for (int k = 0; k < kBlock; ++k) at[k] *= sd(link * kBlock + k);
    }
  }

  // d body / d u_k of the link that k belongs to. Shape: push [kBlock].
  void Push(const Point& point, int k, T* push) const {
    const int link = k / kBlock, own = k % kBlock;
    for (int i = 0; i < kBlock; ++i) push[i] = T(0);
    push[kRotor] = T(own == kRotor) * sd(k);
    if (own == kRotor) return;
    T jacobian[100];
    const T* central = point.central + link * kBlock;
    BodyJacobian(central[0], central + 1, jacobian);
    for (int i = 0; i < 10; ++i) push[i] = jacobian[i * 10 + own] * sd(k);
  }

  // Prior and eps / 2 times barrier: returns the first derivative by u_k, adds the second ones to column [k + 1].
  T AddCurvature(const Point& point, T eps, int k, T* column) const {
    if (k >= kBodies) return T(0);  // an effect's prior is in the data term
    const int at = k / kBlock * kBlock, own = k % kBlock;
    const T* central = point.central + at;
    const T weight = T(0.5) * eps * sd(k);
    column[k] += T(1);
    if (own == kRotor) {
      const T inverse = math::Divide(T(1), central[kRotor]);
      column[k] += weight * inverse * inverse * sd(k);
      return point.u[k] - weight * inverse;
    }
    T second[10];
    const T first = BarrierDerivatives(central, margin_[k / kBlock], own, second);
    for (int i = 0; i <= own; ++i) column[at + i] += weight * second[i] * sd(at + i);
    return point.u[k] + weight * first;
  }

 private:
  static void ToOrigins(Point& point) {
    for (int at = 0; at < kBodies; at += kBlock) {
      FromCentral(point.central + at, point.body + at);
      point.body[at + kRotor] = point.central[at + kRotor];
    }
  }

  MapPrior<Layout> prior_ = {};
  T margin_[kLinks] = {};
};

}  // namespace armcal::physical
