// filter - the estimate and its covariance P = U D U': memory layout, and the update by one row or one rank-one sum.
//
// G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977 (measurement); W. S. Agee, R. H.
// Turner, 1972 (rank-one sum). A row of zeros leaves every bit as it was. So a row that must not count is masked to
// zeros, and the instructions are the same whatever the numbers are.
//
// FactorWork and the functions before it use the look-up tables of an order, not the type of a layout. So one copy of
// their code serves all filters of a form. Their loops are not inlined. That costs no instructions: a loop in a
// function of its own has all registers, and the caller keeps its own. Context: background.
#pragma once

#include "armcal/filter/order.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/math/columns.hpp"
#include "armcal/math/elementary.hpp"
#include "armcal/math/symmetric.hpp"

namespace armcal::filter {

// Where the numbers are. x points at: the estimate, the row that is being processed and its gain, [shape->size] each,
// then the factor's elements.
template <Form form>
struct Factor {
  const Shape<form>* shape;
  float* x;

  float* row() const { return x + shape->size; }
  float* gain() const { return x + 2 * shape->size; }
  float* column(int p) const { return x + shape->Origin(p); }  // element (i, p) of the factor is column(p)[i]
  float& d(int p) const { return column(p)[p]; }
};

// x = 0, and the prior's covariance: dense_ud for the dense columns, 1 for every other active column. Slopes start at
// zero and as known.
template <Form form>
ARMCAL_NOINLINE void StartAtPrior(Factor<form> f, const float* dense_ud, const std::uint32_t* active) {
  const auto& shape = *f.shape;
  for (float* k = f.x; k <= &f.d(shape.size - 1); ++k) *k = 0.0f;
  const auto* const at = shape.position;
  for (int k = 0; k < shape.states; ++k) f.d(at[k]) = math::Masked(1.0f, active[k]);
  for (int j = 0; j < shape.denses; ++j) {
    float* column = f.column(at[shape.fronts + j]);
    for (int i = 0; i <= j; ++i) column[at[shape.fronts + i]] = *dense_ud++;
  }
}

// Raises every dense D that is below the floor to the floor. Returns how many it raised.
template <Form form>
ARMCAL_NOINLINE std::uint32_t HoldFloor(Factor<form> f, float link_floor, const std::uint32_t* active) {
  std::uint32_t held = 0;
  for (int k = f.shape->fronts; k < f.shape->states; ++k) {
    const float floor = math::Masked(link_floor, active[k]);
    float& d = f.d(f.shape->position[k]);
    held += d < floor;
    d = math::Max(d, floor);
  }
  return held;
}

// Adds to variance [size] what the columns from `next` on give to the diagonal of P, as long as credit lasts. All
// columns together, from variance = 0 on, give the diagonal. Returns true when all are added. x as in Factor.
template <Form form>
ARMCAL_NOINLINE bool AddDiagonal(const Shape<form>& shape, const float* x, float* variance, int& next, int& credit) {
  int p = next, left = credit;
  for (; p < shape.size && left > 0; ++p) {
    const float* column = x + shape.Origin(p);
    const float weight = column[p];
    const int begin = shape.Begin(p);
    for (int i = begin; i < p; ++i) variance[i] += weight * column[i] * column[i];
    variance[p] += weight;
    left -= 8 + (p - begin) / 2;
  }
  credit = left;
  next = p;
  return p == shape.size;
}

// The work on one row or one rank-one sum. A slice (slices.hpp) ends between two columns. Between two slices other code
// may run, but it must not begin other work on the same object, and must not change the factor.
template <Form form>
class FactorWork {
 public:
  using Shape = filter::Shape<form>;
  using Factor = filter::Factor<form>;

  // The cost of a row. The constants (a column's own work, a row's beginning and end) were measured.
  static constexpr int RowCost(const Shape& shape, int first, Front front) {
    int cost = BeginCost(shape, first) + ApplyCost(shape);
    for (int p = first; p < shape.size; p = shape.Above(p, front))
      cost += ProjectCost(p - first) + MeasureCost(p - shape.Begin(p));
    return cost;
  }

  // The row y = h' x + noise of `variance` > 0. The caller has filled in h from position `first` on; before, it is
  // zero.
  ARMCAL_NOINLINE void BeginRow(Factor f, int first, Front front, float y, float variance) {
    first_ = first, front_ = front;
    innovation_ = y - math::Dot(f.row() + first, f.x + first, f.shape->size - first);
    alpha_ = sum_ = variance;
    for (int p = 0; p < f.shape->size; ++p) f.gain()[p] = 0.0f;
    next_ = f.shape->size - 1;
    stage_ = Stage::kBegun;
  }
  // Returns true when the row is done. Bit p of `considered`: the column at position p has uncertainty and does not
  // move. nullptr: there is none.
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
  float innovation() const { return innovation_; }  // of the row that was begun last
  float variance() const { return sum_; }           // h' P h + noise, before the row

  static constexpr int SumCost(const Shape& shape, int last) {  // of BeginUnitSum
    const int columns = last + 1 - shape.Begin(last);
    return columns * FoldCost(0) + columns * (columns - 1) * 5 / 8;
  }
  // P + c e e' with c >= 0, where e is the unit vector of position p <= last. In the block form p and last lie in the
  // front of one joint. The instructions depend on `last` alone.
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

  // P + c a a' with c >= 0 and a = row, which is zero after position `last`. All columns that it touches begin at the
  // same position.
  void BeginSum(Factor f, float c, int last) {
    alpha_ = c;
    next_ = last;
    first_ = f.shape->Begin(last);
    stage_ = Stage::kSum;
  }

  // row = U' h in place, from the last column to the first; sum_ becomes h' P h + noise. Two neighbouring columns that
  // begin at the same position are processed together. If there is no such pair, second = column and q = p, so the same
  // code works for one column.
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
    const float* const row = f.row();
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

  // Updates the D of one column and gives what its elements need. Returns the next alpha.
  static float Pivot(float f, float alpha, float& d, float& shift, float& v) {
    v = d * f;
    shift = -f / alpha;
    const float next = alpha + v * f;
    d *= alpha / next;  // exactly 1 for f = 0
    return next;
  }

  // x moves by gain times innovation. Considered columns follow Schmidt's form: their gain is zero, and S k k' goes
  // back to P, where k is the gain that they would have had.
  void Apply(Factor f, const std::uint32_t* considered) {
    const float scale = 1.0f / alpha_, step = innovation_;
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

  float alpha_ = 0.0f, sum_ = 0.0f, innovation_ = 0.0f;
  int next_ = 0, first_ = 0;
  Front front_ = {};
  Stage stage_ = Stage::kIdle;
};

// The room for an estimate and its factor in a filter's order, with the work on them.
template <class Order>
class UdEstimate {
 public:
  using Columns = Order;
  static constexpr int kSize = Order::kSize;
  static constexpr const auto& kShape = Order::kShape;
  using Work = FactorWork<Order::kForm>;

  // The cost of a sample's rows.
  static constexpr int kRowsCost = [] {
    int cost = 0;
    for (int i = 0; i < Order::kJoints; ++i)
      cost += Work::RowCost(Order::kShape, Order::kAt.first[i], Order::FrontOf(i));
    return cost;
  }();

  float& u(int i, int p) { return factor().column(p)[i]; }
  float& d(int p) { return factor().d(p); }
  float d(int p) const { return number_[kShape.Origin(p) + p]; }
  float& x(int p) { return number_[p]; }
  float x(int p) const { return number_[p]; }
  const float* elements() const { return number_ + 3 * kSize; }  // [Order::kElements], of the factor
  // P is the sum over all positions p of d u u', with u [kSize] by columns. Fills in u and returns d.
  float Spread(int p, float* u) const {
    const float* column = number_ + kShape.Origin(p);
    for (int k = 0; k < kSize; ++k) u[k] = 0.0f;
    for (int i = kShape.Begin(p); i < p; ++i) u[kShape.column[i]] = column[i];
    u[kShape.column[p]] = 1.0f;
    return column[p];
  }

  template <class Prior>
  void Start(const Prior& prior) {
    StartAtPrior(factor(), prior.dense_ud, prior.active);
  }
  template <class Prior>
  std::uint32_t HoldFloor(const Prior& prior) {
    return filter::HoldFloor(factor(), prior.link_floor, prior.active);
  }
  bool AddDiagonal(float* variance, int& next, int& credit) const {
    return filter::AddDiagonal(kShape, number_, variance, next, credit);
  }

  // The work on a row or a sum: see FactorWork.
  float* row() { return factor().row(); }  // [kSize] by positions, for the row's h
  void BeginRow(int first, int joint, float y, float variance) {
    work_.BeginRow(factor(), first, Order::FrontOf(joint), y, variance);
  }
  bool StepRow(const std::uint32_t* considered, int& credit) { return work_.StepRow(factor(), considered, credit); }
  float innovation() const { return work_.innovation(); }
  float variance() const { return work_.variance(); }
  void BeginUnitSum(int p, float c, int last) { work_.BeginUnitSum(factor(), p, c, last); }
  bool StepSum(int& credit) { return work_.StepSum(factor(), credit); }
  void AddUnit(int p, float c, int last) {  // the whole sum
    BeginUnitSum(p, c, last);
    int all = kNoSlices;
    (void)StepSum(all);
  }

 private:
  Factor<Order::kForm> factor() { return {&kShape, number_}; }

  float number_[3 * kSize + Order::kElements] = {};
  Work work_;
};

}  // namespace armcal::filter
