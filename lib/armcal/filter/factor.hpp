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

inline constexpr int kRowsAtOnce = 2;  // so many rows the factor takes together

// Where the numbers are. x points at: the estimate [shape->size], the rows that are being processed
// [shape->size][kRowsAtOnce], then the factor's elements. While the rows are processed, their gains take their place. A
// rank-one sum has its vector [shape->size] in the same room.
template <Form form>
struct Factor {
  const Shape<form>* shape;
  float* x;

  float* row(int p) const { return x + shape->size + kRowsAtOnce * p; }  // element p of each row
  float* sum() const { return x + shape->size; }
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

// The work on a group of rows or on one rank-one sum. Between two slices (slices.hpp) other code may run, but it must
// not begin other work on the same object, and must not change the factor.
//
// The factor takes the rows in their order. But only f = U' h of the first row and v = D f of it are needed to know
// what the first row does to f of the second: U changes by gain times shift, so f changes by (gain' h) times shift,
// and gain' h is a sum of v times f. So both rows are projected with the same U, and both change U in one pass.
template <Form form>
class FactorWork {
 public:
  using Shape = filter::Shape<form>;
  using Factor = filter::Factor<form>;

  // The cost of a group of rows. The constants (a block's own work, the rows' beginning and end) were measured.
  static constexpr int RowsCost(const Shape& shape, const RowPlace (&place)[kRowsAtOnce]) {
    const Touched touched(shape, place);
    int cost = BeginCost(shape) + ApplyCost(shape);
    for (const Front& front : touched.front)
      for (int j = 0, count = front.end - front.begin; j < count; j += Width(count, j))
        cost += ProjectCost(Width(count, j), j) + MeasureCost(Width(count, j), j);
    for (int j = touched.shared, count = shape.Shared(); j < count; j += Width(count, j)) {
      const int p = shape.At(j), width = Width(count, j);
      cost += ProjectCost(width, p - touched.first) + MeasureCost(width, p);
    }
    return cost;
  }

  // A group begins: no row is in it yet. Until it is done, the caller fills in each row's elements (Factor::row), and
  // calls BeginRow. A row that is not given is a row of zeros.
  ARMCAL_NOINLINE void BeginRows(Factor f) {
    float* const row = f.row(0);
    math::internal::ByFours(kRowsAtOnce * f.shape->size, [&](int k) ARMCAL_INLINE { row[k] = 0.0f; });
    for (int i = 0; i < kRowsAtOnce; ++i) innovation_[i] = 0.0f, alpha_[i] = 1.0f, place_[i] = kNoRow;
    stage_ = Stage::kBegun;
  }
  // Row i of the group: y = h' x + noise of `variance` > 0.
  void BeginRow(int i, RowPlace place, float y, float variance) {
    place_[i] = place;
    innovation_[i] = y;
    alpha_[i] = variance;
  }
  // Returns true when the rows are done. Bit p of `considered`: the column at position p has uncertainty and does not
  // move. Then only row 0 may be given. nullptr: there is none.
  ARMCAL_NOINLINE bool StepRows(Factor f, const std::uint32_t* considered, int& credit) {
    if (stage_ == Stage::kBegun) {
      Predict(f);
      credit -= BeginCost(*f.shape);
    }
    if (stage_ == Stage::kProject && !Project(f, credit)) return false;
    if (stage_ == Stage::kMeasure) {
      if (!Measure(f, credit)) return false;
      credit -= ApplyCost(*f.shape);
      Apply(f, considered);
    }
    return stage_ == Stage::kIdle || StepSum(f, credit);
  }
  // Of row i of the group that was done last: the innovation, and h' P h + noise. The rows before it are worked in.
  float innovation(int i) const { return innovation_[i]; }
  float variance(int i) const { return variance_[i]; }

  static constexpr int SumCost(const Shape& shape, int last) {  // of BeginUnitSum
    const int columns = last + 1 - shape.Begin(last);
    return columns * FoldCost(0) + columns * (columns - 1) * kFoldCost / 64;
  }
  // P + c e e' with c >= 0, where e is the unit vector of position p <= last. In the block form p and last lie in the
  // front of one joint. The instructions depend on `last` alone.
  ARMCAL_NOINLINE void BeginUnitSum(Factor f, int p, float c, int last) {
    for (int k = f.shape->Begin(last); k <= last; ++k) f.sum()[k] = 0.0f;
    f.sum()[p] = 1.0f;
    BeginSum(f, c, last);
  }
  ARMCAL_NOINLINE bool StepSum(Factor f, int& credit) {
    float c = alpha_[0];
    int p = next_, left = credit;
    const int first = touched_.first;
    float* const row = f.sum();
    while (p >= first && left > 0) {
      // Each column takes what lies between it and the last of them; then all take the rest together. At the end of a
      // slice, columns are taken one by one.
      const int length = p - first, width = length + 1 < kBlock || left < kBlock * FoldCost(length) ? 1 : kBlock;
      const int last = p - width + 1;
      float* column[kBlock];
      float fold[kBlock][2];
      for (int k = 0; k < width; ++k, --p) {
        column[k] = f.column(p) + first;
        const float a = row[p], old = f.d(p);
        const float now = old + c * a * a;
        const std::uint32_t some = math::MaskOf(now > 1e-30f);
        const float inverse = 1.0f / math::Max(now, 1e-30f);
        fold[k][0] = a;
        fold[k][1] = math::Masked(c * a * inverse, some);
        f.d(p) = now;
        c *= math::Select(some != 0u, old * inverse, 1.0f);
        const int from = width == 1 ? first : last;
        math::Fold(row + from, f.column(p) + from, a, fold[k][1], p - from);
        left -= FoldCost(p - first);
      }
      if (width == kBlock) math::FoldColumns<kBlock>(row + first, column, fold[0], last - first);
    }
    credit = left;
    alpha_[0] = c, next_ = p;
    if (p < first) stage_ = Stage::kIdle;
    return p < first;
  }

 private:
  static constexpr int kRows = kRowsAtOnce, kBlock = kBlockColumns;

  // The columns that a group touches: the front columns of its rows, and the shared columns from number `shared` on.
  // Before position `first` all rows are zero.
  struct Touched {
    Front front[kRows] = {};
    int first = 0, shared = 0, count = 0;

    constexpr Touched() = default;
    constexpr Touched(const Shape& shape, const RowPlace (&place)[kRows])
        : first(shape.size), shared(shape.Shared()), count(shared) {
      for (int i = 0; i < kRows; ++i) {
        front[i] = place[i].front;
        first = math::Min<int>(first, place[i].first);
        shared = math::Min<int>(shared, place[i].shared);
      }
    }
  };
  // How many of `count` columns are processed together, from number j on.
  static constexpr int Width(int count, int j) { return (count - j) % kBlock == 0 ? kBlock : 1; }

  // Of an element of a block, in quarters, with its share of the call; so many elements are worth a call.
  static constexpr int kRestCost = math::kMovesGroups ? 21 : 24, kLeastRest = 8;
  static constexpr int kFoldCost = math::kMovesGroups ? 17 : 27;  // of an element of a rank-one sum, in 32nds
  // BeginCost covers the caller's work on the last row, too.
  static constexpr int BeginCost(const Shape& shape) { return 70 + 3 * shape.size / 2; }
  static constexpr int ApplyCost(const Shape& shape) { return 15 + shape.size; }
  static constexpr int ProjectCost(int width, int length) { return width == 1 ? 5 + 3 * length / 4 : 24 + 3 * length; }
  static constexpr int MeasureCost(int width, int length) {
    return width == 1 ? 14 + 2 * length : 40 + kRestCost * length / 4;
  }
  static constexpr int FoldCost(int length) { return 13 + kFoldCost * length / 32; }

  enum class Stage : std::uint8_t { kIdle, kBegun, kProject, kMeasure, kSum };

  // P + c a a' with c >= 0 and a = sum(), which is zero after position `last`. All columns that it touches begin at the
  // same position.
  void BeginSum(Factor f, float c, int last) {
    alpha_[0] = c;
    next_ = last;
    touched_.first = f.shape->Begin(last);
    stage_ = Stage::kSum;
  }

  // The innovations by the estimate before the group.
  void Predict(Factor f) {
    touched_ = Touched(*f.shape, place_);
    const int first = touched_.first;
    const float* const x = f.x + first;
    float sum[kRows] = {};
    math::Dots<kRows, 1>(f.row(first), &x, f.shape->size - first, sum);
    for (int i = 0; i < kRows; ++i) innovation_[i] -= sum[i];
    shared_ = 0.0f;
    next_ = touched_.count;
    measured_ = 0;
    fronts_done_ = false;
    stage_ = Stage::kProject;
  }

  // h becomes f = U' h in place, from the last column to the first. At the end of a slice, columns are taken one by
  // one.
  ARMCAL_NOINLINE bool Project(Factor f, int& credit) {
    const Shape& shape = *f.shape;
    const int first = touched_.first;
    int j = next_, left = credit;
    while (j > touched_.shared && left > 0) {
      const bool whole = j >= kBlock && (touched_.count - j) % kBlock == 0;
      const int width = whole && left > ProjectCost(kBlock, shape.At(j - kBlock) - first) ? kBlock : 1;
      j -= width;
      const int p = shape.At(j);
      if (width == 1) ProjectColumn(f, first, shape.At(BlockBegin(touched_.count, j)), p);
      else ProjectBlock(f, first, p);
      left -= ProjectCost(width, p - first);
    }
    next_ = j;
    if (j <= touched_.shared && left > 0) {
      for (const Front& front : touched_.front)
        for (int p = front.end; p > front.begin;) {
          const int width = p - front.begin < kBlock ? 1 : kBlock;
          p -= width;
          if (width == 1) ProjectColumn(f, front.begin, p, p);
          else ProjectBlock(f, front.begin, p);
          left -= ProjectCost(width, p - front.begin);
        }
      stage_ = Stage::kMeasure;
    }
    credit = left;
    return stage_ == Stage::kMeasure;
  }
  // Column p of a block that begins at `block`. The sums have the order of ProjectBlock.
  static ARMCAL_NOINLINE void ProjectColumn(Factor f, int first, int block, int p) {
    const float *const corner = f.column(p) + block, *const rest = f.column(p) + first;
    if (p > block) math::Dots<kRows, 1>(f.row(block), &corner, p - block, f.row(p));
    if (block > first) math::Dots<kRows, 1>(f.row(first), &rest, block - first, f.row(p));
  }
  // The columns at p, p + 1, ... p + kBlock - 1.
  static ARMCAL_NOINLINE void ProjectBlock(Factor f, int first, int p) {
    using math::internal::Each;
    const float* column[kBlock];
    float* const row = f.row(p);
    float h[kBlock * kRows];
    Each<kBlock * kRows>([&](auto k) ARMCAL_INLINE { h[k] = row[k]; });
    Each<kBlock>([&](auto k) ARMCAL_INLINE {
      const float* const corner = f.column(p + k) + p;
      Each<kRows>([&](auto i) ARMCAL_INLINE {
        float sum = h[k * kRows + i];
        Each<k>([&](auto m) ARMCAL_INLINE { sum += corner[m] * h[m * kRows + i]; });
        row[k * kRows + i] = sum;
      });
      column[k] = corner - (p - first);
    });
    if (p > first) math::Dots<kRows, kBlock>(f.row(first), column, p - first, row);
  }

  // Each column, from the first to the last, changes by the gains of the columns before it; then its own elements of
  // the gains take the place of f. A slice may end within a block of shared columns, after any of its elements.
  ARMCAL_NOINLINE bool Measure(Factor f, int& credit) {
    const Shape& shape = *f.shape;
    int j = next_, left = credit;
    if (!fronts_done_) {
      for (const Front& front : touched_.front)
        for (int p = front.begin; p < front.end;) {
          const int width = Width(front.end, p);
          if (width == 1) MeasureColumn(f, front.begin, p);
          else MeasureCorner(f, p), MeasureRest(f, p, front.begin, p);
          left -= MeasureCost(width, p - front.begin);
          p += width;
        }
      fronts_done_ = true;
    }
    while (j < touched_.count && left > 0) {
      const int p = shape.At(j);
      if (Width(touched_.count, j) == 1) {
        MeasureColumn(f, 0, p);
        left -= MeasureCost(1, p);
        ++j;
        continue;
      }
      if (measured_ == 0) {
        MeasureCorner(f, p);
        left -= MeasureCost(kBlock, 0);
      }
      const int most = measured_ + math::Max(left / kRestCost * 4, kLeastRest), end = math::Min(p, most);
      MeasureRest(f, p, measured_, end);
      left -= kRestCost * (end - measured_) / 4;
      measured_ = end < p ? end : 0;
      j += end < p ? 0 : kBlock;
    }
    credit = left;
    next_ = j;
    return j >= touched_.count;
  }
  // Elements from `begin` on.
  ARMCAL_NOINLINE void MeasureColumn(Factor f, int begin, int p) {
    float step[2 * kRows];
    float* const column = f.column(p);
    Pivot(f.row(p), column[p], alpha_, shared_, step);
    float* const from = column + begin;
    math::BiermanBlock<kRows, 1>(f.row(begin), &from, step, p - begin);
  }
  // The columns at p, p + 1, ... p + kBlock - 1: their elements from p on. Then the elements from begin to end.
  ARMCAL_NOINLINE void MeasureCorner(Factor f, int p) {
    using math::internal::Each;
    float* const row = f.row(p);
    float own[kBlock * kRows], alpha[kRows], shared = shared_;
    Each<kRows>([&](auto i) ARMCAL_INLINE { alpha[i] = alpha_[i]; });
    Each<kBlock * kRows>([&](auto k) ARMCAL_INLINE { own[k] = row[k]; });
    Each<kBlock>([&](auto k) ARMCAL_INLINE {
      float* const corner = f.column(p + k) + p;
      float* const c = step_ + k * 2 * kRows;
      Pivot(own + k * kRows, corner[k], alpha, shared, c);
      Each<k>([&](auto m) ARMCAL_INLINE {
        float u = corner[m];
        Each<kRows>([&](auto i) ARMCAL_INLINE {
          math::internal::BiermanElement()(own[m * kRows + i], u, c[2 * i], c[2 * i + 1]);
        });
        corner[m] = u;
      });
    });
    Each<kRows>([&](auto i) ARMCAL_INLINE { alpha_[i] = alpha[i]; });
    Each<kBlock * kRows>([&](auto k) ARMCAL_INLINE { row[k] = own[k]; });
    shared_ = shared;
  }
  ARMCAL_NOINLINE void MeasureRest(Factor f, int p, int begin, int end) const {
    float* column[kBlock];
    math::internal::Each<kBlock>([&](auto k) ARMCAL_INLINE { column[k] = f.column(p + k) + begin; });
    if (begin < end) math::BiermanBlock<kRows, kBlock>(f.row(begin), column, step_, end - begin);
  }

  // Updates the D of one column and gives what its elements need. f [kRows] becomes v. step [kRows][2]: v and shift.
  // alpha [kRows], shared: as the members.
  ARMCAL_INLINE static void Pivot(float* f, float& d, float* alpha, float& shared, float* step) {
    static_assert(kRows == 2);
    float left = d;
    math::internal::Each<kRows>([&](auto i) ARMCAL_INLINE {
      if constexpr (i == 1) math::internal::BiermanElement()(shared, f[1], step[0], step[1]);
      const float v = left * f[i], next = alpha[i] + v * f[i];
      step[2 * i] = v;
      step[2 * i + 1] = -f[i] / alpha[i];
      left *= alpha[i] / next;  // exactly 1 for f = 0
      alpha[i] = next;
      f[i] = v;
    });
    d = left;
  }

  // x moves by gain times innovation. Considered columns follow Schmidt's form: their gain is zero, and S k k' goes
  // back to P, where k is the gain that they would have had.
  void Apply(Factor f, const std::uint32_t* considered) {
    const int size = f.shape->size;
    for (int i = 0; i < kRows; ++i) variance_[i] = alpha_[i];
    const float scale = 1.0f / alpha_[0];
    if (considered == nullptr) {
      const float step = scale * innovation_[0];
      innovation_[1] -= shared_ * step;
      const float step2 = 1.0f / alpha_[1] * innovation_[1];
      float *x = f.x, *gain = f.row(0);
      math::internal::ByFours(size, [&](int) ARMCAL_INLINE {
        *x = *x + gain[0] * step + gain[1] * step2;
        ++x, gain += kRows;
      });
      stage_ = Stage::kIdle;
      return;
    }
    for (int p = 0; p < size; ++p) {
      const std::uint32_t kept = 0u - ((considered[p / 32] >> (p % 32)) & 1u);
      const float k = f.row(p)[0] * scale;
      f.x[p] += math::Masked(k, ~kept) * innovation_[0];
      f.sum()[p] = math::Masked(k, kept);  // row(p) lies at 2 p, so it is read before it is overwritten
    }
    BeginSum(f, alpha_[0], size - 1);
  }

  float alpha_[kRows] = {}, innovation_[kRows] = {}, variance_[kRows] = {};
  float shared_ = 0.0f;  // of the present group: gain of row 0 times h of row 1, as far as the columns are measured
  int next_ = 0;
  // Of Measure: v and shift of the present block, and how many of its elements are done.
  float step_[2 * kBlock * kRows] = {};
  int measured_ = 0;
  bool fronts_done_ = false;
  RowPlace place_[kRows] = {};
  Touched touched_;
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

  // The cost of a sample's rows, if the factor takes `together` of them at a time.
  static constexpr int RowsCost(int together) {
    int cost = 0;
    for (int i = 0; i < Order::kJoints; i += together) {
      const bool two = together == 2 && i + 1 < Order::kJoints;
      cost += Work::RowsCost(Order::kShape, {Order::PlaceOf(i), two ? Order::PlaceOf(i + 1) : kNoRow});
    }
    return cost;
  }
  static constexpr int kRowsCost = RowsCost(kRowsAtOnce), kSingleRowsCost = RowsCost(1);

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

  // The work on rows or a sum: see FactorWork.
  float* row(int i) { return factor().row(0) + i; }  // its element at position p is row(i)[p * kRowsAtOnce]
  void BeginRows() { work_.BeginRows(factor()); }
  void BeginRow(int i, RowPlace place, float y, float variance) { work_.BeginRow(i, place, y, variance); }
  bool StepRows(const std::uint32_t* considered, int& credit) { return work_.StepRows(factor(), considered, credit); }
  float innovation(int i) const { return work_.innovation(i); }
  float variance(int i) const { return work_.variance(i); }
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
