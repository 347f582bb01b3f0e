// physical - what a read-out minimises: what the data alone said, and what prior and barrier say of the bodies.
#pragma once

#include "armcal/math/symmetric.hpp"
#include "armcal/physical/body.hpp"

namespace armcal::physical {

// Layout: the constants of a generated model (model/contract.hpp). Columns are [front, rigid, dense effects]; prior
// units: x_k = (b_k - b0_k) / s_k.
template <class Layout>
struct MapPrior {
  const float* body;      // [kBodyParameters] table's means, 11 a link: ten about the link origin, rotor inertia
  const float* body_sd;   // [kBodyParameters] of m, c, I about the centre, rotor; 0: held
  const float* column;    // [kColumns] b0
  const float* scale;     // [kColumns] s; 0: held
  const float* dense_ud;  // [UdSize(kDense)] the filter's prior of the dense columns, in prior units
};

// What comes out.
template <class Layout, class T>
struct MapResult {
  T body[Layout::kBodyParameters] = {};     // about the link origins, the table's order
  T body_sd[Layout::kBodyParameters] = {};  // of m, c, I about the centre, rotor
  T column[Layout::kColumns] = {};          // filter coordinates that belong to these bodies, own units
  T column_sd[Layout::kColumns] = {};       // deviations: inverse curvature of data and prior, without the barrier
  T moved = T(0);    // sum over all parameters of (change / prior deviation)^2: with a true prior, no more than ...
  T learned = T(0);  // ... chi^2 of so many degrees, their sum of 1 - (deviation / prior deviation)^2
  int steps = 0;     // of Newton's method
  T barrier = T(0);  // the last eps
  bool converged = false;  // less than 1e-4 of chi^2 is left to gain; the bodies can exist in any case

  // Of one parameter, held if before = 0.
  void Learn(T change, T after, T before) {
    const T left = math::Divide(after, before);
    moved += change * change;
    learned += math::Select(before > T(0), T(1) - left * left, T(0));
  }
};

// v [n] = b U^-1 for the unit upper triangle of the n columns from `offset` on, in place; b is zero before `first`.
template <int n, class S, class T>
void SolveRow(const S* ud, int offset, int first, T* v) {
  for (int i = first + 1; i < n; ++i) {
    const S* column = ud + math::UdIndex(offset, offset + i);
    for (int k = first; k < i; ++k) v[i] -= v[k] * T(column[k]);
  }
}

// Row [kDense] of dense columns in prior units -> row [kBodyParameters + dense effects] of bodies about the link
// origins: b = B body.
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

// What the data alone say of y = [bodies about the link origins - their means, dense effects in prior units], all
// friction left free: minus log likelihood = y' information y / 2 + gradient' y. It is the filter's information less
// that of the prior which the filter started from: P^-1 - C^-1, with P^-1 = U^-T D^-1 U^-1 row by row.
template <class Layout, class T>
class DataInformation {
 public:
  static constexpr int kFree = Layout::kBodyParameters + Layout::kDense - Layout::kRigid;
  static constexpr int kRows = Layout::kDense + Layout::kRigid;  // calls of AddRow

  void Clear() {
    for (T& a : packed_) a = T(0);
  }
  // Row k of the filter's U^-1, then of the prior's. x [kColumns], ud [UdSize(kColumns)]: the filter's result in the
  // order [front, dense]: the dense part of the factor is then that of P without the front columns. gradient [kFree]
  // gets the row's part.
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

// Front column k given the dense ones: x_k = value + row' w, with that variance about it. row [kDense].
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
