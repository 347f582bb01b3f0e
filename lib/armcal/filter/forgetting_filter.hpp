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

  // The cost of the rows and the end of a sample (slices.hpp).
  static constexpr int SampleCost() {
    int cost = kEndCost;
    for (int i = 0; i < Layout::kJoints; ++i) {
      const int length = Layout::kFrontBegin[i + 1] - Layout::kFrontBegin[i] + Layout::kDense - Layout::kRowBegin[i];
      cost += kRowCost + length * kColumnCost + length * (length + 1) / 2;
    }
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
    bool inside_row = false;
  };

  // Starts without data. The prior must stay as it is while the filter works.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    for (float& d : d_) d = kFloor;
    for (float& r : rows_) r = 0.0f;
  }

  // One whitened row of `joint`. Shapes: front [the joint's front columns]; dense [kDense], zero before
  // kRowBegin[joint]. If use is false or the report is not kOk, no bit of the triangle changes, and the instructions
  // are the same. After BeginRow call StepRow, which spends credit (slices.hpp), until it answers true; then report().
  void BeginRow(int joint, const float* front, const float* dense, float y, bool use) {
    const int begin = Layout::kRowBegin[joint];
    first_ = Layout::kFrontBegin[joint];
    width_ = Layout::kFrontBegin[joint + 1] - first_;
    length_ = width_ + Layout::kDense - begin;
    dense_first_ = Layout::kFront + begin;
    std::uint32_t largest = 0;
    const auto put = [&](int k, float value) {
      largest = math::Max(largest, MagnitudeBits(value));
      row_[k] = value;
    };
    for (int k = 0; k < width_; ++k) put(k, front[k]);
    for (int k = begin; k < Layout::kDense; ++k) put(width_ + k - begin, dense[k]);
    put(length_, y);
    const std::uint32_t taken = Admit(use, largest, report_);
    for (int k = 0; k <= length_; ++k) row_[k] = math::Masked(row_[k], taken);
    weight_ = 1.0f;
    next_ = 0;
  }
  ARMCAL_NOINLINE bool StepRow(int& credit) {  // out of line, so that no caller takes its registers
    int k = next_, left = credit;
    float weight = weight_;
    float* const row = row_;
    for (; k < length_ && left > 0; ++k) {
      const int column = ColumnAt(k), after = ColumnAt(k + 1), rest = length_ - k - 1;
      weight = math::GivensRows(d_ + column, rows_ + kOffsets.at[column], d_ + after, rows_ + kOffsets.at[after],
                                row[k], row + k + 1, rest, weight);
      left -= kColumnCost + rest + 1;
      if (rest == 0) continue;
      left -= kColumnCost + rest;
      ++k;
    }
    credit = left;
    next_ = k;
    weight_ = weight;
    if (k < length_) return false;
    credit -= kRowCost;
    report_.innovation = row_[length_];
    weight = math::Max(weight, 1e-30f);
    report_.variance = 1.0f / weight;
    return true;
  }
  const UpdateReport& report() const { return report_; }

  // Once after the rows of a sample. A front column forgets if its joint moves (bit i of `moving`), a dense column if
  // all joints move. A joint at rest brings no new data, so what is known of it must not fade.
  void BeginEnd(std::uint32_t moving) {
    constexpr std::uint32_t kAll = (1u << Layout::kJoints) - 1u;
    int k = 0;
    for (int i = 0; i <= Layout::kJoints; ++i) {
      const bool moves = i < Layout::kJoints ? (moving >> i & 1u) != 0u : (moving & kAll) == kAll;
      for (const int end = ColumnsOfBlock<Layout>(i, kColumns).end; k < end; ++k)
        d_[k] = math::Max(d_[k] * math::Select(moves, prior_->lambda[k], 1.0f), kFloor);
    }
  }
  bool StepEnd(int& credit) {
    credit -= kEndCost;
    return true;
  }

  // What the filter knew of a block no longer counts: its columns start again without data. block: a joint (its front
  // columns), or kJoints (the dense columns). The rows of front columns also contain dense columns. After a reset of
  // these, such a row says less about its front column, so its weight is reduced. Only between samples; the calls are
  // the same for all filters.
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
  // then StepReadOut until it answers true. No row between.
  void BeginReadOut(ReadOut& out) const {
    out.estimate.Start(*prior_);
    for (int p = 0; p < kColumns; ++p) out.estimate.d(p) *= 1.0f / (1.0f - kFloor);
    for (float& v : out.variance) v = 0.0f;
    out.next = out.next_diagonal = 0;
    out.inside_row = false;
  }
  bool StepReadOut(ReadOut& out, int& credit) const {
    for (; out.next < kColumns && credit > 0; ++out.next) {
      if (!out.inside_row) BeginTake(out.next, out.estimate);
      out.inside_row = !out.estimate.StepRow(nullptr, credit);
      if (out.inside_row) return false;
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
  int ColumnAt(int k) const { return k < width_ ? first_ + k : dense_first_ + k - width_; }  // of the row in work

  static constexpr int kColumnCost = 6, kRowCost = 24, kEndCost = 2 * kColumns;

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

  // Begins to work row `column` of the triangle into the read-out's estimate.
  void BeginTake(int column, UdEstimate<Columns>& estimate) const {
    const float* stored = rows_ + kOffsets.at[column];
    const auto& at = Columns::kAt.position;
    float* row = estimate.row();
    for (int p = at[column]; p < kColumns; ++p) row[p] = 0.0f;
    row[at[column]] = 1.0f;
    int joint = Layout::kJoints, k = column + 1;
    if (column < Layout::kFront) {
      joint = JointOf<Layout>(column);
      const int own = Layout::kFrontBegin[joint + 1] - k;
      Scatter(stored, at + k, own, row);
      stored += own;
      k = Layout::kFront + Layout::kRowBegin[joint];
    }
    Scatter(stored, at + k, kColumns - k, row);
    estimate.BeginRow(at[column], joint, stored[kColumns - k], 1.0f / d_[column], 0.0f);
  }

  const Prior<Layout>* prior_ = nullptr;
  UpdateReport report_;
  float d_[kColumns] = {};
  float rows_[kTriangle] = {};
  float row_[kColumns + 1] = {};  // what remains of the row in work
  float weight_ = 0.0f;
  int first_ = 0, width_ = 0, length_ = 0, dense_first_ = 0, next_ = 0;
};

}  // namespace armcal::filter
