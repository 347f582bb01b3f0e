// filter - an estimate x and its covariance U D U', worked on in slices; knows positions, not columns.
//
// G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977 (measurement); W. S. Agee, R. H.
// Turner, 1972 (rank-one sum). A row of zeros leaves every bit as it was, so that a masked row is a row of zeros; the
// instructions are the same whatever the numbers are.
//
// Slices (slices.hpp) end between two columns; between slices anything may happen but another call of the same object.
// Context: background.
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
  // P is the sum over positions p of d u u', u [kSize] by columns: fills in u, returns d.
  float Spread(int p, float* u) const {
    for (int k = 0; k < kSize; ++k) u[k] = 0.0f;
    for (int i = Order::kAt.begin[p]; i < p; ++i) u[Order::kAt.column[i]] = element_[Order::Origin(p) + i];
    u[Order::kAt.column[p]] = 1.0f;
    return d(p);
  }

  float* row() { return row_; }  // room for a row h, by positions

  // The row y = h' x + noise of `variance` > 0; h as filled in from `first` on, zero before. In the block form `joint`
  // is the one whose front columns it touches (kJoints: none). gate_sigma > 0: an innovation beyond changes no bit.
  void BeginRow(int first, int joint, float y, float variance, float gate_sigma) {
    first_ = first, joint_ = joint;
    innovation_ = y - math::Dot(row_ + first, x_ + first, kSize - first);
    alpha_ = sum_ = variance;
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

  static constexpr int SumCost(int last) {  // of BeginUnitSum
    int cost = 0;
    for (int p = Order::kAt.begin[last]; p <= last; ++p) cost += FoldCost(p - Order::kAt.begin[p]);
    return cost;
  }
  // P + c e e', c >= 0, e the unit vector of position p <= last; in the block form both in one joint's front. `last`
  // alone decides the instructions.
  void BeginUnitSum(int p, float c, int last) {
    for (int k = Order::kAt.begin[last]; k <= last; ++k) row_[k] = 0.0f;
    row_[p] = 1.0f;
    BeginSum(c, last);
  }
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
    alpha_ = c, next_ = p;
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

  // The next position that the row touches, after or before p.
  static int Above(int p, int joint) {
    for (++p; p < kSize && Order::Skips(p, joint);) p = Order::kAt.front_end[Order::kAt.joint[p]];
    return p;
  }
  static int Below(int p, int first, int joint) {
    for (--p; p >= first && Order::Skips(p, joint);) p = Order::kAt.first[Order::kAt.joint[p]] - 1;
    return p;
  }

  // row = U' h in place, from the last column back; h' P h on the way. Two columns at once whose rows begin at the same
  // place; one alone is its own second.
  bool Project(int& credit) {
    const int first = first_, joint = joint_;
    int p = next_, left = credit;
    float sum = sum_;
    float* const row = row_;
    while (p >= first && left > 0) {
      const int begin = Order::kAt.begin[p], from = begin > first ? begin : first, below = Below(p, first, joint);
      const bool pair = below >= first && Order::kAt.begin[below] == begin;
      const int q = pair ? below : p;
      const float* const column = element_ + Order::Origin(p);
      const float* const second = element_ + Order::Origin(q);
      float f = row[p], g = row[q];
      for (int i = q; i < p; ++i) f += column[i] * row[i];
      math::Dot(column + from, second + from, row + from, q - from, f, g);
      row[q] = g;
      row[p] = f;
      sum += column[p] * f * f;
      left -= ProjectCost(p - from);
      if (pair) {
        sum += second[q] * g * g;
        left -= ProjectCost(q - from);
      }
      p = pair ? Below(q, first, joint) : below;
    }
    credit = left;
    sum_ = sum;
    next_ = p;
    if (p >= first_) return false;
    const float limit = gate_sigma_ * gate_sigma_ * sum;
    taken_ = ~(math::MaskOf(gate_sigma_ > 0.0f) & math::MaskOf(innovation_ * innovation_ > limit));
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
    while (p < kSize && left > 0) {
      const int begin = Order::kAt.begin[p], q = Above(p, joint);
      const bool pair = q < kSize && Order::kAt.begin[q] == begin;
      float* const column = element_ + Order::Origin(p);
      float shift, v;
      alpha = Pivot(math::Masked(row_[p], taken), alpha, column[p], shift, v);
      left -= MeasureCost(p - begin);
      if (pair) {
        float* const second = element_ + Order::Origin(q);
        float shift2, v2;
        alpha = Pivot(math::Masked(row_[q], taken), alpha, second[q], shift2, v2);
        left -= MeasureCost(q - begin);
        math::BiermanColumns(column + begin, second + begin, gain + begin, shift, v, shift2, v2, p - begin);
        gain[p] = v;
        math::BiermanColumn(second + p, gain + p, shift2, v2, q - p);
        gain[q] = v2;
      } else {
        math::BiermanColumn(column + begin, gain + begin, shift, v, p - begin);
        gain[p] = v;
      }
      p = pair ? Above(q, joint) : q;
    }
    credit = left;
    alpha_ = alpha;
    next_ = p;
    return p >= kSize;
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
