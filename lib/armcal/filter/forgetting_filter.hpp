// filter - least squares of the data with exponential forgetting, kept as an information triangle.
#pragma once

#include "armcal/filter/factor.hpp"
#include "armcal/filter/prior.hpp"
#include "armcal/filter/row.hpp"

namespace armcal::filter {

// Holds the information R' diag(d) R and z of the data alone; the prior enters at the read-out. The columns are in the
// order [front, dense]. A front column meets only the rows of its own joint, so zeros of the triangle stay zero and are
// not stored. The triangle is stored row by row as
//   [later front columns of the joint, dense columns from kRowBegin[joint] on, z]      for a front column,
//   [later dense columns, z]                                                           for a dense column.
// Every d starts at kFloor, a millionth of the prior's weight, and never falls below it. The read-out takes that much
// off the prior, so that nothing is counted twice. Context of every call: background.
template <class Layout>
class ForgettingFilter : public WholeRows<ForgettingFilter<Layout>> {
 public:
  static constexpr int kColumns = Layout::kColumns;
  static constexpr bool kExtended = false;
  static constexpr float kFloor = 1e-6f;
  using Columns = Order<Layout, Form::kBlock, Beside::kNothing>;

  // Where the stored rows begin.
  struct Offsets {
    std::uint16_t at[kColumns + 1] = {};
    constexpr Offsets() {
      for (int k = 0; k < kColumns; ++k) at[k + 1] = static_cast<std::uint16_t>(at[k] + RowLength(k));
    }
    static constexpr int RowLength(int k) {
      if (k >= Layout::kFront) return kColumns - k;
      const int joint = JointOf<Layout>(k);
      return Layout::kFrontBegin[joint + 1] - k + Layout::kDense - Layout::kRowBegin[joint];
    }
  };
  static constexpr Offsets kOffsets{};
  static constexpr int kTriangle = kOffsets.at[kColumns];

  // First dense column with which row i is processed. It is kRowBegin[i], or the smallest kRowBegin of a later row, if
  // that is smaller. So the rows that take part in a column are always the first ones.
  struct Starts {
    std::uint8_t at[Layout::kJoints] = {};
    bool ordered = true;  // all are kRowBegin
    int width = 0;        // the most front columns that a row has
    constexpr Starts() {
      for (int i = Layout::kJoints - 1, least = Layout::kDense; i >= 0; --i) {
        const int begin = Layout::kRowBegin[i], fronts = Layout::kFrontBegin[i + 1] - Layout::kFrontBegin[i];
        ordered &= begin <= least;
        least = begin < least ? begin : least;
        at[i] = static_cast<std::uint8_t>(least);
        width = fronts > width ? fronts : width;
      }
    }
  };
  static constexpr Starts kStart{};

  // The cost of the rows and the end of a sample (slices.hpp).
  static constexpr int SampleCost() {
    int cost = kEndCost + Layout::kJoints * kRowCost;
    for (int k = 0; k < kPassCount; ++k) cost += kPasses.at[k].cost;
    return cost;
  }

  // This form suits every prior. It does not use process noise, and estimates considered columns like others.
  static bool Suits(const Prior<Layout>&) { return true; }

  // The estimate in prior units and its standard deviation, by column. The rest is work space.
  struct ReadOut {
    float x[kColumns] = {};
    float sd[kColumns] = {};
    float variance[kColumns] = {};
    UdEstimate<Columns> estimate;
    int next = 0, next_diagonal = 0;
    bool inside_rows = false;
  };

  // Starts without data. The prior must not change while the filter works.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    for (float& d : d_) d = kFloor;
    for (float& r : rows_) r = 0.0f;
  }

  // One whitened row of `joint`. Shapes: front [the joint's front columns]; dense [kDense], zero before
  // kRowBegin[joint]. If use is false or the report is not kOk, the row acts as a row of zeros: no bit of the triangle
  // changes, and the instructions are the same. The rows of a sample are processed together: after BeginRow and StepRow
  // of each of them call StepRows, which spends credit (slices.hpp), until it returns true; then report().
  void BeginRow(int joint, const float* front, const float* dense, float y, bool use) {
    const int first = Layout::kRowBegin[joint], width = Layout::kFrontBegin[joint + 1] - Layout::kFrontBegin[joint];
    const int seen = Layout::kDense - first;
    const std::uint32_t largest = LargestOf(front, width, LargestOf(dense + first, seen, MagnitudeBits(y)));
    const std::uint32_t taken = Admit(use, largest, report_[joint]);
    float* const row = block_ + Slot(first) + joint;
    CopyMasked<kJoints>(front, width, taken, row - width * kJoints);
    CopyMasked<kJoints>(dense + first, seen, taken, row);
    row[seen * kJoints] = math::Masked(y, taken);
    weight_[joint] = 1.0f;
    begun_ |= 1u << joint;
    next_ = 0;
  }
  bool StepRow(int& credit) {
    credit -= kRowCost;
    return true;
  }
  ARMCAL_NOINLINE bool StepRows(int& credit) {  // out of line, so that no caller takes its registers
    if (next_ == 0) ClearOthers();
    int k = next_, left = credit;
    for (; k < kPassCount && left > 0; ++k) {
      const Pass& pass = kPasses.at[k];
      if (!kStart.ordered && pass.column == Layout::kFront) ClearBeforeRows();
      Work(pass);
      left -= pass.cost;
    }
    credit = left;
    next_ = k;
    if (k < kPassCount) return false;
    for (int i = 0; i < kJoints; ++i) {
      report_[i].innovation = block_[Slot(Layout::kDense) + i];
      report_[i].variance = 1.0f / math::Max(weight_[i], 1e-30f);
    }
    begun_ = 0;
    return true;
  }
  const UpdateReport& report(int joint) const { return report_[joint]; }

  // Once after the rows of a sample. A front column forgets if its joint moves (bit i of `moving`), a dense column if
  // all joints move. A joint at rest brings no new data, so what is known of it must not fade.
  void BeginEnd(std::uint32_t moving) {
    constexpr std::uint32_t kAll = (1u << Layout::kJoints) - 1u;
    for (int i = 0; i < Layout::kJoints; ++i)
      Forget(Layout::kFrontBegin[i], Layout::kFrontBegin[i + 1], moving >> i & 1u);
    Forget(Layout::kFront, kColumns, (moving & kAll) == kAll);
  }
  bool StepEnd(int& credit) {
    credit -= kEndCost;
    return true;
  }

  // What the filter knew of one part of the columns no longer counts: they start again without data. block: a joint
  // (its front columns), or kJoints (the dense columns). The rows of front columns also contain dense columns. After a
  // reset of these, such a row says less about its front column, so its weight is reduced. Only between samples; the
  // calls are the same for all filters.
  static constexpr bool CanReset(int block) { return block >= 0 && block <= Layout::kJoints; }
  void BeginReset(int block) {
    const ColumnRange columns = ColumnsOfBlock<Layout>(block, kColumns);
    for (int k = columns.begin; k < columns.end; ++k) d_[k] = kFloor;
    next_ = block < Layout::kJoints ? Layout::kFront : 0;
  }
  bool StepReset(int& credit) {
    for (; next_ < Layout::kFront && credit > 0; ++next_) credit -= WidenByDense(next_);
    credit -= kEndCost;
    return next_ >= Layout::kFront;
  }

  // What the data alone say, by back substitution; zero where they say nothing. Shape: x [kColumns], prior units.
  // Without prior and standard deviation this is a hundredth of the read-out's work.
  void Solve(float* x) const {
    for (int k = kColumns - 1; k >= Layout::kFront; --k) {
      const float* row = rows_ + kOffsets.at[k];
      const int length = kColumns - 1 - k;
      x[k] = row[length] - math::Dot(row, x + k + 1, length);
    }
    for (int i = Layout::kJoints - 1; i >= 0; --i) {
      const float* seen = x + Layout::kFront + Layout::kRowBegin[i];
      const int end = Layout::kFrontBegin[i + 1], dense = Layout::kDense - Layout::kRowBegin[i];
      for (int k = end - 1; k >= Layout::kFrontBegin[i]; --k) {
        const float* row = rows_ + kOffsets.at[k];
        const float* coupling = row + (end - 1 - k);
        float own = 0.0f;
        for (int later = k + 1; later < end; ++later) own += *row++ * x[later];
        x[k] = coupling[dense] - own - math::Dot(coupling, seen, dense);
      }
    }
  }

  // Read-out in slices: the prior's factor takes the triangle's rows as measurements of variance 1 / d. BeginReadOut,
  // then StepReadOut until it returns true. The filter must not take a row in between.
  void BeginReadOut(ReadOut& out) const {
    out.estimate.Start(*prior_);
    for (int p = 0; p < kColumns; ++p) out.estimate.d(p) *= 1.0f / (1.0f - kFloor);
    for (float& v : out.variance) v = 0.0f;
    out.next = out.next_diagonal = 0;
    out.inside_rows = false;
  }
  bool StepReadOut(ReadOut& out, int& credit) const {
    for (; out.next < kColumns && credit > 0; out.next = EndOfTake(out.next)) {
      if (!out.inside_rows) BeginTake(out.next, out.estimate);
      out.inside_rows = !out.estimate.StepRows(nullptr, credit);
      if (out.inside_rows) return false;
    }
    if (out.next < kColumns || !out.estimate.AddDiagonal(out.variance, out.next_diagonal, credit)) return false;
    for (int k = 0; k < kColumns; ++k) {
      const int p = Columns::kAt.position[k];
      out.x[k] = out.estimate.x(p);
      out.sd[k] = math::Sqrt(out.variance[p]);
    }
    return true;
  }

  const float* weights() const { return d_; }      // [kColumns] d of each row
  const float* triangle() const { return rows_; }  // [kTriangle] R and z, row by row

 private:
  static constexpr int kJoints = Layout::kJoints;
  static constexpr int kRowCost = 20 + Layout::kDense, kEndCost = 10 + 3 * kColumns / 2;

  // The rows stand side by side. Element k of row i is block_[Slot(k) + i]: k < kDense a dense column, kDense the
  // measurement. The front columns of a row stand just before its first dense column, as in the triangle.
  static constexpr int Slot(int dense) { return (kStart.width + dense) * kJoints; }

  // One pass: processes `rows` rows of the sample, from row `first` on, with `columns` stored rows, from `column` on.
  // length: how many elements a row has after these columns.
  struct Pass {
    std::uint16_t stored, block;  // where the first stored row begins in rows_, and its element in block_
    std::uint16_t cost;
    std::uint8_t column, columns, first, rows, length;
  };
  static constexpr int kMostRows = kJoints < 6 ? kJoints : 6;  // of a pass
  static constexpr int kFewRows = kJoints < 2 ? kJoints : 2;   // so many are processed with four columns at a time
  template <int most>
  struct Passes {
    Pass at[most] = {};
    int count = 0;
    constexpr Passes() {
      for (int i = 0; i < kJoints; ++i)
        for (int k = Layout::kFrontBegin[i], end = Layout::kFrontBegin[i + 1]; k < end;) {
          const int columns = end - k < 4 ? end - k : 4;
          Add(k, columns, i, 1, Layout::kRowBegin[i] - (end - k));
          k += columns;
        }
      for (int k = 0, rows = 0; k < Layout::kDense;) {
        int columns = (Layout::kDense - k) % 2 == 0 ? 2 : 1;
        while (rows < kJoints && kStart.at[rows] < k + columns) ++rows;
        const bool more = rows < kJoints && kStart.at[rows] < k + 4;  // a row begins at the third column or the fourth
        const bool last = k + 4 == Layout::kDense;  // GivensCorner does all of them, whatever the number of rows
        if (columns == 2 && k + 4 <= Layout::kDense && (rows <= kFewRows || last) && !more) columns = 4;
        for (int i = 0; i < rows; i += kMostRows)
          Add(Layout::kFront + k, columns, i, rows - i < kMostRows ? rows - i : kMostRows, k);
        k += columns;
      }
    }
    constexpr bool Has(int columns, int rows = 0) const {  // 0: any number
      for (int k = 0; k < most; ++k)
        if (at[k].columns == columns && (rows == 0 || at[k].rows == rows)) return true;
      return false;
    }

   private:
    constexpr void Add(int column, int columns, int first, int rows, int element) {
      const int length = Layout::kDense + 1 - element - columns, area = rows * columns;
      if (count < most) {
        Pass& pass = at[count];
        pass.stored = kOffsets.at[column];
        pass.block = static_cast<std::uint16_t>(Slot(element) + first);
        pass.column = static_cast<std::uint8_t>(column);
        pass.columns = static_cast<std::uint8_t>(columns);
        pass.first = static_cast<std::uint8_t>(first);
        pass.rows = static_cast<std::uint8_t>(rows);
        pass.length = static_cast<std::uint8_t>(length);
        pass.cost = static_cast<std::uint16_t>(12 + area * 3 + area * length * math::kPairCost / 8);
      }
      ++count;
    }
  };
  static constexpr int kPassCount = Passes<1>().count;
  static constexpr Passes<kPassCount> kPasses{};

  template <int columns, int... row>
  void WorkColumns(const Pass& pass, std::integer_sequence<int, row...>) {
    float* const block = block_ + pass.block;
    float* const stored = rows_ + pass.stored;
    float rotation[2 * kMostRows * columns];
    const int front = pass.column < Layout::kFront ? Layout::kDense : pass.column - Layout::kFront;
    math::GivensCorner<columns, kJoints>(d_ + pass.column, stored, block, pass.length, kStart.at + pass.first, front,
                                         pass.rows, weight_ + pass.first, rotation);
    const auto fold = [&](auto rows) {
      if constexpr (kPasses.Has(columns, rows))
        if (pass.rows == rows && pass.length > 1)
          math::FoldBlock<rows, columns, kJoints>(block, stored, rotation, pass.length);
    };
    (fold(std::integral_constant<int, row + 1>{}), ...);
  }
  void Work(const Pass& pass) {
    constexpr auto many = std::make_integer_sequence<int, kMostRows>{};
    constexpr auto few = std::make_integer_sequence<int, kFewRows>{};
    constexpr auto one = std::make_integer_sequence<int, 1>{};
    if constexpr (kPasses.Has(1))
      if (pass.columns == 1) return WorkColumns<1>(pass, many);
    if constexpr (kPasses.Has(2))
      if (pass.columns == 2) return WorkColumns<2>(pass, many);
    if constexpr (kPasses.Has(3))
      if (pass.columns == 3) return WorkColumns<3>(pass, one);
    if constexpr (kPasses.Has(4))
      if (pass.columns == 4) return WorkColumns<4>(pass, few);
  }

  // Columns that do not forget are multiplied by 1.
  void Forget(int begin, int end, bool moves) {
    static constexpr float kNone = 1.0f;
    const float* const factors[2] = {&kNone, prior_->lambda + begin};
    const float* lambda = factors[moves];
    const int step = moves;
    float* d = d_ + begin;
    math::internal::ByFours(end - begin, [&](int) ARMCAL_INLINE {
      *d = math::Max(*d * *lambda, kFloor);
      ++d, lambda += step;
    });
  }

  // A row that the sample does not have is a row of zeros.
  void ClearOthers() {
    for (int i = 0; i < kJoints; ++i) {
      if ((begun_ >> i & 1u) != 0u) continue;
      for (int k = i; k < Slot(Layout::kDense + 1); k += kJoints) block_[k] = 0.0f;
      weight_[i] = 1.0f;
      report_[i] = UpdateReport{};
    }
  }

  // Between kStart and the row's own beginning, where its front columns stood.
  void ClearBeforeRows() {
    for (int i = 0; i < kJoints; ++i)
      for (int k = kStart.at[i]; k < Layout::kRowBegin[i]; ++k) block_[Slot(k) + i] = 0.0f;
  }

  // The dense columns of a front column's row may be anywhere in their prior. That acts on the row as additional noise,
  // and this reduces the row's weight accordingly. Returns the work, in elements.
  int WidenByDense(int column) {
    const int joint = JointOf<Layout>(column), begin = Layout::kRowBegin[joint];
    const float* coupling = rows_ + kOffsets.at[column] + (Layout::kFrontBegin[joint + 1] - 1 - column);
    float variance = 0.0f;
    for (int j = begin; j < Layout::kDense; ++j) {
      const float* u = prior_->dense_ud + math::UdIndex(0, j);
      const float along = coupling[j - begin] + math::Dot(coupling, u + begin, j - begin);
      variance += u[j] * along * along;
    }
    d_[column] = math::Max(d_[column] / (1.0f + d_[column] * variance), kFloor);
    return (Layout::kDense - begin) * (Layout::kDense - begin + 1) / 2;
  }

  // The read-out's estimate takes the triangle's rows in groups: those of `column` and of the next columns of the same
  // block, up to the one that this returns.
  static constexpr int EndOfTake(int column) {
    const int joint = JointOf<Layout>(column), end = joint < kJoints ? Layout::kFrontBegin[joint + 1] : kColumns;
    return math::Min(column + kRowsAtOnce, end);
  }
  void BeginTake(int column, UdEstimate<Columns>& estimate) const {
    estimate.BeginRows();
    for (int k = column; k < EndOfTake(column); ++k) Take(k, k - column, estimate);
  }
  // Row `column` of the triangle becomes row i of a group.
  void Take(int column, int i, UdEstimate<Columns>& estimate) const {
    const float* stored = rows_ + kOffsets.at[column];
    const auto& at = Columns::kAt.position;
    float* const row = estimate.row(i);
    row[at[column] * kRowsAtOnce] = 1.0f;
    RowPlace place = {0, 0, {0, 0}};
    int k = column + 1;
    if (column < Layout::kFront) {
      const int joint = JointOf<Layout>(column), own = Layout::kFrontBegin[joint + 1] - k;
      Scatter<kRowsAtOnce>(stored, at + k, own, ~0u, row);
      stored += own;
      k = Layout::kFront + Layout::kRowBegin[joint];
      place = Columns::PlaceOf(joint);
      if (i > 0) place.front = {0, 0};  // row 0 has named them
    } else {
      place.shared = static_cast<std::uint8_t>(BlockBegin(Columns::kShared, column - Layout::kFront));
    }
    place.first = at[column];
    Scatter<kRowsAtOnce>(stored, at + k, kColumns - k, ~0u, row);
    estimate.BeginRow(i, place, stored[kColumns - k], 1.0f / d_[column]);
  }

  const Prior<Layout>* prior_ = nullptr;
  UpdateReport report_[Layout::kJoints];
  float d_[kColumns] = {};
  float rows_[kTriangle] = {};
  float block_[(kStart.width + Layout::kDense + 1) * Layout::kJoints] = {};  // what remains of the rows of the sample
  float weight_[kJoints] = {};
  std::uint32_t begun_ = 0;  // rows of the present sample, a bit each
  int next_ = 0;             // pass
};

}  // namespace armcal::filter
