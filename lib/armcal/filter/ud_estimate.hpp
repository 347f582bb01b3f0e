// filter - an estimate x and its covariance U D U', worked on in slices; knows positions, not columns.
//
// G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977 (measurement); W. S. Agee, R. H.
// Turner, 1972 (rank-one sum). A row of zeros leaves every bit as it was, so that a masked row is a row of zeros; the
// instructions are the same whatever the numbers are.
//
// A slice spends `credit`, in elements of a column (eight instructions), and stops before the next column (or two,
// worked on as one) once none is left; what it owes is taken off the next slice. Context: background; between slices
// anything may happen but another call of the same object.
#pragma once

#include "armcal/filter/order.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/math/columns.hpp"
#include "armcal/math/elementary.hpp"

namespace armcal::filter {

template <class Order>
class UdEstimate {
 public:
  using Columns = Order;
  static constexpr int kSize = Order::kSize;

  // What a row spends, in all; what a column's own work and a row's beginning and end are worth was measured.
  static constexpr int RowCost(int first, int joint) {
    int cost = kRowCost;
    for (int p = first; p < kSize; ++p) {
      if (Order::Skips(p, joint)) continue;
      const int begin = Order::kAt.begin[p], from = begin > first ? begin : first;
      cost += ProjectCost(p - from) + MeasureCost(p - begin);
    }
    return cost;
  }

  // x = 0, U = 1, D = 0.
  void Clear() {
    for (float& u : element_) u = 0.0f;
    for (float& x : x_) x = 0.0f;
  }
  float& u(int i, int p) { return element_[Order::Origin(p) + i]; }
  float& d(int p) { return element_[Order::kAt.start[p + 1] - 1]; }
  float d(int p) const { return element_[Order::kAt.start[p + 1] - 1]; }
  float& x(int p) { return x_[p]; }
  float x(int p) const { return x_[p]; }
  const float* elements() const { return element_; }  // [Order::kElements]

  // Room for a row h by positions: all zero.
  float* ClearRow() {
    for (float& h : row_) h = 0.0f;
    return row_;
  }

  // The row y = h' x + noise of `variance` > 0, h as filled in, zero before `first`. In the block form `joint` is the
  // one whose front columns it touches (-1: none). gate_sigma > 0: an innovation beyond changes no bit.
  void BeginRow(int first, int joint, float y, float variance, float gate_sigma) {
    first_ = first;
    joint_ = joint;
    innovation_ = y - math::Dot(row_ + first, x_ + first, kSize - first);
    alpha_ = variance;
    sum_ = variance;
    gate_sigma_ = gate_sigma;
    for (float& g : gain_) g = 0.0f;
    next_ = kSize - 1;
    stage_ = Stage::kProject;
  }
  // True: the row is in. `considered`: bit p of position p that counts and does not move; nullptr: none.
  bool StepRow(const std::uint32_t* considered, int& credit) {
    if (stage_ == Stage::kProject) {
      if (!Project(credit)) return false;
      credit -= kRowCost;
    }
    if (stage_ == Stage::kMeasure) {
      if (!Measure(credit)) return false;
      Apply(considered);
    }
    return stage_ == Stage::kIdle || StepSum(credit);
  }
  float innovation() const { return innovation_; }  // of the row in work, or the last one
  float variance() const { return sum_; }           // h' P h + noise, before the row
  bool inside() const { return taken_ != 0u; }      // the gate

  static constexpr int SumCost(int last) {
    int cost = 0;
    for (int p = Order::kAt.begin[last]; p <= last; ++p) cost += FoldCost(p - Order::kAt.begin[p]);
    return cost;
  }
  // P + c e e', c >= 0, e the unit vector of position p <= last; in the block form a front column's, with last = p.
  // The instructions depend on `last` alone.
  void BeginUnitSum(int p, float c, int last) {
    for (int k = Order::kAt.begin[last]; k <= last; ++k) row_[k] = 0.0f;
    row_[p] = 1.0f;
    BeginSum(c, last);
  }
  // True: done.
  bool StepSum(int& credit) {
    float c = alpha_;
    int p = next_;
    for (; p >= first_ && credit > 0; --p) {
      float* column = element_ + Order::Origin(p);
      const int begin = Order::kAt.begin[p];
      const float a = row_[p], old = column[p];
      const float now = old + c * a * a;
      const std::uint32_t some = math::MaskOf(now > 1e-30f);
      const float inverse = 1.0f / math::Max(now, 1e-30f);
      math::Fold(row_ + begin, column + begin, a, math::Masked(c * a * inverse, some), p - begin);
      column[p] = now;
      c *= math::Select(some != 0u, old * inverse, 1.0f);
      credit -= FoldCost(p - begin);
    }
    alpha_ = c;
    next_ = p;
    if (p < first_) stage_ = Stage::kIdle;
    return p < first_;
  }

  static constexpr int DiagonalCost(int p) { return kColumnCost + (p - Order::kAt.begin[p]) / 2; }
  // variance [kSize] += this column's part of the diagonal of P; all columns from variance = 0 on give it.
  void AddDiagonal(int p, float* variance) const {
    const float* column = element_ + Order::Origin(p);
    const float weight = column[p];
    for (int i = Order::kAt.begin[p]; i < p; ++i) variance[i] += weight * column[i] * column[i];
    variance[p] += weight;
  }

 private:
  static constexpr int kRowCost = 60, kColumnCost = Order::kForm == Form::kBlock ? 8 : 6;
  static constexpr int ProjectCost(int length) { return kColumnCost + length / 2; }
  static constexpr int MeasureCost(int length) { return kColumnCost + 2 + length; }
  static constexpr int FoldCost(int length) { return 12 + length; }

  enum class Stage : std::uint8_t { kIdle, kProject, kMeasure, kSum };

  // P + c a a', c >= 0, a = row, zero after position `last`.
  void BeginSum(float c, int last) {
    alpha_ = c;
    next_ = last;
    first_ = Order::kAt.begin[last];
    stage_ = Stage::kSum;
  }

  // True: the columns p and p + 1 can be worked on as one.
  bool Pair(int p) const {
    return p >= first_ && p + 1 < kSize && Order::kAt.begin[p] == Order::kAt.begin[p + 1] && !Order::Skips(p, joint_) &&
           !Order::Skips(p + 1, joint_);
  }

  // row = U' h in place, from the last column back; h' P h on the way.
  bool Project(int& credit) {
    const int first = first_, joint = joint_;
    int p = next_, left = credit;
    float sum = sum_;
    float* const row = row_;
    for (; p >= first && left > 0; --p) {
      if (Order::Skips(p, joint)) continue;
      const float* column = element_ + Order::Origin(p);
      const int begin = Order::kAt.begin[p], from = begin > first ? begin : first;
      left -= ProjectCost(p - from);
      if (Pair(p - 1)) {
        const float* before = element_ + Order::Origin(p - 1);
        float f = row[p], g = row[p - 1];
        f += column[p - 1] * g;
        math::Dot(column + from, before + from, row + from, p - 1 - from, f, g);
        row[p] = f;
        sum += column[p] * f * f;
        row[--p] = g;
        sum += before[p] * g * g;
        left -= ProjectCost(p - from);
      } else {
        const float f = math::Dot(column + from, row + from, p - from, row[p]);
        row[p] = f;
        sum += column[p] * f * f;
      }
    }
    credit = left;
    sum_ = sum;
    next_ = p;
    if (p >= first_) return false;
    const bool inside = !(gate_sigma_ > 0.0f && innovation_ * innovation_ > gate_sigma_ * gate_sigma_ * sum);
    taken_ = math::MaskOf(inside);
    next_ = first_;
    stage_ = Stage::kMeasure;
    return true;
  }

  bool Measure(int& credit) {
    const int joint = joint_;
    const std::uint32_t taken = taken_;
    int p = next_, left = credit;
    float alpha = alpha_;
    float* const gain = gain_;
    for (; p < kSize && left > 0; ++p) {
      if (Order::Skips(p, joint)) continue;
      const int begin = Order::kAt.begin[p], length = p - begin;
      float* const column = element_ + Order::Origin(p);
      float shift, v;
      alpha = Pivot(math::Masked(row_[p], taken), alpha, column[p], shift, v);
      left -= MeasureCost(length);
      if (Pair(p)) {
        float* const after = element_ + Order::Origin(p + 1);
        float shift2, v2;
        alpha = Pivot(math::Masked(row_[p + 1], taken), alpha, after[p + 1], shift2, v2);
        math::BiermanColumns(column + begin, after + begin, gain + begin, shift, v, shift2, v2, length);
        gain[p] = v;
        math::BiermanColumn(after + p, gain + p, shift2, v2, 1);
        gain[++p] = v2;
        left -= MeasureCost(length + 1);
      } else {
        math::BiermanColumn(column + begin, gain + begin, shift, v, length);
        gain[p] = v;
      }
    }
    credit = left;
    alpha_ = alpha;
    next_ = p;
    if (p < kSize) return false;
    return true;
  }

  // D of one column; what its elements need. Returns the next alpha.
  static float Pivot(float f, float alpha, float& d, float& shift, float& v) {
    v = d * f;
    shift = -f / alpha;
    const float next = alpha + v * f;
    d *= alpha / next;  // exactly 1 for f = 0
    return next;
  }

  // x moves by gain times innovation. Schmidt's form is this update minus what it took from the considered columns:
  // their gain is zero, and S k k' goes back to P.
  void Apply(const std::uint32_t* considered) {
    const float scale = 1.0f / alpha_, step = math::Masked(innovation_, taken_);
    if (considered == nullptr) {
      math::AddScaled(x_, gain_, scale * step, kSize);
      stage_ = Stage::kIdle;
      return;
    }
    for (int p = 0; p < kSize; ++p) {
      const std::uint32_t kept = 0u - ((considered[p / 32] >> (p % 32)) & 1u);
      const float k = gain_[p] * scale;
      x_[p] += math::Masked(k, ~kept) * step;
      row_[p] = math::Masked(k, kept);
    }
    BeginSum(alpha_, kSize - 1);
  }

  float element_[Order::kElements] = {};
  float x_[kSize] = {};
  float row_[kSize] = {};
  float gain_[kSize] = {};
  float alpha_ = 0.0f, sum_ = 0.0f, innovation_ = 0.0f, gate_sigma_ = 0.0f;
  int next_ = 0, first_ = 0, joint_ = -1;
  Stage stage_ = Stage::kIdle;
  std::uint32_t taken_ = 0;  // mask of a row that changes the estimate
};

}  // namespace armcal::filter
