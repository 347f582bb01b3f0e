// physical - the minimum problem of the physical read-out: information of the data, prior and barrier of the bodies.
//
// Map in the names means maximum a posteriori: the read-out looks for the most probable bodies.
#pragma once

#include "armcal/math/symmetric.hpp"
#include "armcal/physical/body.hpp"

namespace armcal::physical {

// What a read-out is given. Layout: the constants of a generated model (model/contract.hpp). Columns are [front, rigid,
// dense effects]. Prior units: x_k = (b_k - b0_k) / s_k.
template <class Layout>
struct MapPrior {
  const float* body;      // [kBodyParameters] the table's means, 11 for each link: ten about the origin, rotor inertia
  const float* body_sd;   // [kBodyParameters] of m, c, I about the centre, rotor; 0: fixed
  const float* column;    // [kColumns] b0
  const float* scale;     // [kColumns] s; 0: fixed
  const float* dense_ud;  // [UdSize(kDense)] the filter's prior of the dense columns, in prior units
};

// The result of a read-out.
template <class Layout, class T>
struct MapResult {
  T body[Layout::kBodyParameters] = {};     // about the link origins, the table's order
  T body_sd[Layout::kBodyParameters] = {};  // of m, c, I about the centre, rotor
  T column[Layout::kColumns] = {};          // filter coordinates that belong to these bodies, own units
  T column_sd[Layout::kColumns] = {};       // deviations come from the curvature of data and prior, without the barrier
  // If the prior is true, `moved` is at most chi^2 of `learned` degrees.
  T moved = T(0);          // sum over all parameters of (change / prior deviation)^2
  T learned = T(0);        // sum over all parameters of 1 - (deviation / prior deviation)^2
  int steps = 0;           // of Newton's method
  T barrier = T(0);        // the last eps
  bool converged = false;  // less than 1e-4 of chi^2 is left to gain. The bodies can exist in any case.

  // Adds one parameter to moved and learned. change: in prior units. after, before: the standard deviations of the
  // result and of the prior, both in the same unit. before = 0: the parameter is fixed.
  void Learn(T change, T after, T before) {
    const T left = math::Divide(after, before);
    moved += change * change;
    learned += math::Select(before > T(0), T(1) - left * left, T(0));
  }
};

// v [n] = b U^-1 in place, for the unit upper triangle of the n columns from `offset` on. b is zero before `first`.
template <int n, class S, class T>
void SolveRow(const S* ud, int offset, int first, T* v) {
  for (int i = first + 1; i < n; ++i) {
    const S* column = ud + math::UdIndex(offset, offset + i);
    for (int k = first; k < i; ++k) v[i] -= v[k] * T(column[k]);
  }
}

// From a row [kDense] over dense columns in prior units to a row [kBodyParameters + dense effects] over bodies about
// the link origins, by b = B body.
template <class Layout, class T>
void RowOfBodies(const float* scale, const T* row, T* out) {
  for (int k = 0; k < Layout::kBodyParameters; ++k) out[k] = T(0);
  for (int r = 0; r < Layout::kRigid; ++r) {
    const T value = math::Divide(row[r], T(scale[Layout::kFront + r]));
    for (int e = Layout::kMapBegin[r]; e < Layout::kMapBegin[r + 1]; ++e)
      out[Layout::kMapColumn[e]] += value * T(Layout::kMapValue[e]);
  }
  for (int k = Layout::kRigid; k < Layout::kDense; ++k) out[Layout::kBodyParameters + k - Layout::kRigid] = row[k];
}

// What the data alone say of y = [bodies about the link origins - their means, dense effects in prior units], with all
// friction free: minus log likelihood = y' information y / 2 + gradient' y. This is the filter's information minus that
// of the prior from which the filter started: P^-1 - C^-1, with P^-1 = U^-T D^-1 U^-1 row by row.
template <class Layout, class T>
class DataInformation {
 public:
  static constexpr int kFree = Layout::kBodyParameters + Layout::kDense - Layout::kRigid;
  static constexpr int kRows = Layout::kDense + Layout::kRigid;  // calls of AddRow

  void Clear() {
    for (T& a : packed_) a = T(0);
  }
  // Adds row k of the filter's U^-1, then (from kDense on) of the prior's. x [kColumns], ud [UdSize(kColumns)]: the
  // filter's result in prior units, in the order [front, dense]. In this order, the dense part of the factor is that of
  // P without the front columns. The row's part is added to gradient [kFree], which is over y.
  void AddRow(int k, const MapPrior<Layout>& prior, const T* x, const T* ud, T* gradient) {
    constexpr int kFront = Layout::kFront;
    T v[Layout::kDense] = {}, a[kFree], at = T(0), weight;
    const bool from_filter = k < Layout::kDense;
    const int row = from_filter ? k : k - Layout::kDense;
    v[row] = T(1);
    if (from_filter) {
      SolveRow<Layout::kDense>(ud, kFront, row, v);
      for (int i = 0; i < Layout::kDense; ++i) at += v[i] * x[kFront + i];
      weight = math::Divide(T(1), ud[math::UdIndex(kFront + row, kFront + row)]);
    } else {
      SolveRow<Layout::kRigid>(prior.dense_ud, 0, row, v);
      weight = math::Divide(T(-1), T(prior.dense_ud[math::UdIndex(row, row)]));
    }
    RowOfBodies<Layout>(prior.scale, v, a);
    T* packed = packed_;
    for (int j = 0; j < kFree; ++j) {
      const T scaled = weight * a[j];
      for (int i = 0; i <= j; ++i) *packed++ += scaled * a[i];
      gradient[j] -= scaled * at;
    }
  }
  T at(int i, int j) const { return packed_[i < j ? math::UdIndex(i, j) : math::UdIndex(j, i)]; }
  // out = information y. Shapes: [kFree].
  void Times(const T* y, T* out) const {
    const T* packed = packed_;
    for (int j = 0; j < kFree; ++j) {
      T sum = T(0);
      const T own = y[j];
      for (int i = 0; i < j; ++i) {
        sum += packed[i] * y[i];
        out[i] += packed[i] * own;
      }
      out[j] = sum + packed[j] * own;
      packed += j + 1;
    }
  }

 private:
  T packed_[math::UdSize(kFree)] = {};
};

// The front column k, given the dense columns w: x_k = value + row' w, with `variance` about it. row [kDense].
template <class Layout, class T>
void FrontGivenDense(const T* x, const T* ud, int k, T* row, T& value, T& variance) {
  constexpr int kFront = Layout::kFront, kDense = Layout::kDense;
  for (int i = 0; i < kDense; ++i) row[i] = ud[math::UdIndex(k, kFront + i)];
  SolveRow<kDense>(ud, kFront, 0, row);  // U_fd U_dd^-1
  value = x[k];
  for (int i = 0; i < kDense; ++i) value -= row[i] * x[kFront + i];
  variance = ud[math::UdIndex(k, k)];  // of U_ff D_f U_ff'
  for (int i = k + 1; i < kFront; ++i) {
    const T u = ud[math::UdIndex(k, i)];
    variance += u * u * ud[math::UdIndex(i, i)];
  }
}

// Where a read-out stands. Free coordinates u: [(t - t0) / sd of each body parameter, dense effects in prior units].
template <class Layout, class T>
struct MapPoint {
  T u[Layout::kBodyParameters + Layout::kDense - Layout::kRigid] = {};
  T central[Layout::kBodyParameters] = {};  // t: m, c, I about the centre, rotor
  T body[Layout::kBodyParameters] = {};     // about the link origins
};

// The bodies of all links under prior and barrier.
template <class Layout, class T>
class MapArm {
 public:
  static constexpr int kBodies = Layout::kBodyParameters, kLinks = Layout::kJoints, kBlock = kBodies / kLinks;
  static constexpr int kRotor = kBlock - 1, kFree = kBodies + Layout::kDense - Layout::kRigid;
  // As a share of the trace of S about the link origin. Twice what IsPhysical asks for, so that the result passes it as
  // a table in float32, too.
  static constexpr T kMargin = T(2) * T(kPivotMargin);
  using Point = MapPoint<Layout, T>;
  static_assert(kBlock == 11, "a link has ten parameters about its origin, and a rotor inertia");

  // Returns false if a body of the prior cannot exist, or if a rotor inertia is zero and uncertain. A body near the
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

  // Fills in the bodies of a point from its u.
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

  // to = from + share x step, with step [kFree] in u (prior units). The bodies move on straight lines about their
  // origins (see Move).
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

  // Adds to sum the change of the barrier between two points: -logdet, and -log for a rotor. Returns false if `to` is
  // outside the cone.
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

  // Turns the gradient g [kFree] over [bodies about the link origins in SI units, effects in prior units] into the
  // gradient over u, for the first `links` links, in place.
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

  // d body / d u_k, for the link of k: SI units for one prior unit. Shape: push [kBlock].
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

  // Of the prior plus eps / 2 times the barrier (a minus log likelihood) over u: returns the first derivative by u_k,
  // and adds the second derivatives to column [k + 1].
  T AddCurvature(const Point& point, T eps, int k, T* column) const {
    if (k >= kBodies) return T(0);  // an effect's prior is part of the data term
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
