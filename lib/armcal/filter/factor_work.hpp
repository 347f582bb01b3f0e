// filter - a row or a rank-one sum worked into a factor, in slices; knows positions, not columns.
//
// G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977 (measurement); W. S. Agee, R. H.
// Turner, 1972 (rank-one sum). A row of zeros leaves every bit as it was, so that a masked row is a row of zeros; the
// instructions are the same whatever the numbers are.
//
// Slices (slices.hpp) end between two columns; between slices anything may happen but another call of the same object.
// One copy serves all filters of a form, so nothing of it is inlined. Context: background.
#pragma once

#include "armcal/filter/factor.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/math/columns.hpp"

namespace armcal::filter {

template <Form form>
class FactorWork {
 public:
  using Shape = filter::Shape<form>;
  using Factor = filter::Factor<form>;

  // What a row spends, in all; what a column's own work and a row's beginning and end are worth was measured.
  static constexpr int RowCost(const Shape& shape, int first, Front front) {
    int cost = BeginCost(shape, first) + ApplyCost(shape);
    for (int p = first; p < shape.size; p = shape.Above(p, front))
      cost += ProjectCost(p - first) + MeasureCost(p - shape.Begin(p));
    return cost;
  }

  // The row y = h' x + noise of `variance` > 0; h as filled in from `first` on, zero before. gate_sigma > 0: an
  // innovation beyond changes no bit.
  ARMCAL_NOINLINE void BeginRow(Factor f, int first, Front front, float y, float variance, float gate_sigma) {
    first_ = first, front_ = front;
    innovation_ = y - math::Dot(f.row() + first, f.x + first, f.shape->size - first);
    alpha_ = sum_ = variance;
    gate_sigma_ = gate_sigma;
    for (int p = 0; p < f.shape->size; ++p) f.gain()[p] = 0.0f;
    next_ = f.shape->size - 1;
    stage_ = Stage::kBegun;
  }
  // True: the row is in. `considered`: bit p of position p that counts and does not move; nullptr: none.
  ARMCAL_NOINLINE bool StepRow(Factor f, const std::uint32_t* considered, int& credit) {
    if (stage_ == Stage::kBegun) {
      credit -= BeginCost(*f.shape, first_);
      stage_ = Stage::kProject;
    }
    if (stage_ == Stage::kProject && !Project(f, credit)) return false;
    if (stage_ == Stage::kMeasure) {
      if (!Measure(f, credit)) return false;
      credit -= ApplyCost(*f.shape);
      Apply(f, considered);
    }
    return stage_ == Stage::kIdle || StepSum(f, credit);
  }
  float innovation() const { return innovation_; }  // of the row in work, or the last one
  float variance() const { return sum_; }           // h' P h + noise, before the row
  bool inside() const { return taken_ != 0u; }      // the gate

  static constexpr int SumCost(const Shape& shape, int last) {  // of BeginUnitSum
    const int columns = last + 1 - shape.Begin(last);
    return columns * FoldCost(0) + columns * (columns - 1) * 5 / 8;
  }
  // P + c e e', c >= 0, e the unit vector of position p <= last; in the block form both in one joint's front. `last`
  // alone decides the instructions.
  ARMCAL_NOINLINE void BeginUnitSum(Factor f, int p, float c, int last) {
    for (int k = f.shape->Begin(last); k <= last; ++k) f.row()[k] = 0.0f;
    f.row()[p] = 1.0f;
    BeginSum(f, c, last);
  }
  ARMCAL_NOINLINE bool StepSum(Factor f, int& credit) {
    float c = alpha_;
    int p = next_, left = credit;
    const int first = first_;
    float* const row = f.row();
    for (; p >= first && left > 0; --p) {
      float* const column = f.column(p);
      const float a = row[p], old = column[p];
      const float now = old + c * a * a;
      const std::uint32_t some = math::MaskOf(now > 1e-30f);
      const float inverse = 1.0f / math::Max(now, 1e-30f);
      math::Fold(row + first, column + first, a, math::Masked(c * a * inverse, some), p - first);
      column[p] = now;
      c *= math::Select(some != 0u, old * inverse, 1.0f);
      left -= FoldCost(p - first);
    }
    credit = left;
    alpha_ = c, next_ = p;
    if (p < first) stage_ = Stage::kIdle;
    return p < first;
  }

 private:
  static constexpr int BeginCost(const Shape& shape, int first) { return 45 + 2 * (shape.size - first); }
  static constexpr int ApplyCost(const Shape& shape) { return 20 + shape.size; }
  static constexpr int ProjectCost(int length) { return Shape::kColumnCost + length / 2; }
  static constexpr int MeasureCost(int length) { return Shape::kColumnCost + 2 + length; }
  static constexpr int FoldCost(int length) { return 8 + length + length / 4; }

  enum class Stage : std::uint8_t { kIdle, kBegun, kProject, kMeasure, kSum };

  // P + c a a', c >= 0, a = row, zero after position `last`; all columns that it touches begin at one place.
  void BeginSum(Factor f, float c, int last) {
    alpha_ = c;
    next_ = last;
    first_ = f.shape->Begin(last);
    stage_ = Stage::kSum;
  }

  // row = U' h in place, from the last column back; h' P h on the way. Two columns at once that begin at the same
  // place; one alone is its own second.
  ARMCAL_NOINLINE bool Project(Factor f, int& credit) {
    const Shape& shape = *f.shape;
    const int first = first_;
    const Front front = front_;
    int p = next_, left = credit;
    float sum = sum_;
    float* const row = f.row();
    while (p >= first && left > 0) {
      const int below = shape.Below(p, front);
      const bool pair = below >= first && shape.Begin(below, front) == shape.Begin(p, front);
      const int q = pair ? below : p;
      const float* const column = f.column(p);
      const float* const second = f.column(q);
      float a = row[p];
      for (int i = q; i < p; ++i) a += column[i] * row[i];
      const auto dots = math::Dots(column + first, second + first, row + first, q - first, a, row[q]);
      row[q] = dots.second;
      row[p] = dots.first;
      sum += column[p] * dots.first * dots.first;
      left -= ProjectCost(p - first);
      if (pair) {
        sum += second[q] * dots.second * dots.second;
        left -= ProjectCost(q - first);
      }
      p = pair ? shape.Below(q, front) : below;
    }
    credit = left;
    sum_ = sum;
    next_ = p;
    if (p >= first) return false;
    const float limit = gate_sigma_ * gate_sigma_ * sum;
    taken_ = ~(math::MaskOf(gate_sigma_ > 0.0f) & math::MaskOf(innovation_ * innovation_ > limit));
    next_ = first;
    stage_ = Stage::kMeasure;
    return true;
  }

  ARMCAL_NOINLINE bool Measure(Factor f, int& credit) {
    const Shape& shape = *f.shape;
    const Front front = front_;
    int p = next_, left = credit;
    float alpha = alpha_;
    float* const gain = f.gain();
    // One that is not taken is a row of zeros: the gain's, which stands behind it.
    const float* const row = f.row() + (static_cast<std::uint32_t>(shape.size) & ~taken_);
    while (p < shape.size && left > 0) {
      const int begin = shape.Begin(p, front), q = shape.Above(p, front);
      const bool pair = q < shape.size && shape.Begin(q, front) == begin;
      float* column = f.column(p);
      float shift, v;
      alpha = Pivot(row[p], alpha, column[p], shift, v);
      left -= MeasureCost(p - begin);
      int from = begin, to = p;
      if (pair) {
        float* const second = f.column(q);
        float shift2, v2;
        alpha = Pivot(row[q], alpha, second[q], shift2, v2);
        left -= MeasureCost(q - begin);
        math::BiermanColumns(column + begin, second + begin, gain + begin, shift, v, shift2, v2, p - begin);
        gain[p] = v;
        column = second, shift = shift2, v = v2;
        from = p, to = q;
      }
      math::BiermanColumn(column + from, gain + from, shift, v, to - from);
      gain[to] = v;
      p = pair ? shape.Above(q, front) : q;
    }
    credit = left;
    alpha_ = alpha;
    next_ = p;
    return p >= shape.size;
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
  void Apply(Factor f, const std::uint32_t* considered) {
    const float scale = 1.0f / alpha_, step = math::Masked(innovation_, taken_);
    const int size = f.shape->size;
    if (considered == nullptr) {
      math::AddScaled(f.x, f.gain(), scale * step, size);
      stage_ = Stage::kIdle;
      return;
    }
    for (int p = 0; p < size; ++p) {
      const std::uint32_t kept = 0u - ((considered[p / 32] >> (p % 32)) & 1u);
      const float k = f.gain()[p] * scale;
      f.x[p] += math::Masked(k, ~kept) * step;
      f.row()[p] = math::Masked(k, kept);
    }
    BeginSum(f, alpha_, size - 1);
  }

  float alpha_ = 0.0f, sum_ = 0.0f, innovation_ = 0.0f, gate_sigma_ = 0.0f;
  int next_ = 0, first_ = 0;
  Front front_ = {};
  Stage stage_ = Stage::kIdle;
  std::uint32_t taken_ = 0;  // mask of a row that changes the estimate
};

}  // namespace armcal::filter
