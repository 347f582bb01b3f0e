// filter - least squares of the data with exponential forgetting, as an information triangle; knows columns only.
#pragma once

#include "armcal/filter/prior.hpp"
#include "armcal/math/givens.hpp"

namespace armcal::filter {

// Holds R' diag(d) R and z of the data only; the prior enters at the read-out. Columns in the order [front, dense]:
// a front column meets its own joint's rows only, so the triangle never fills in and is stored row by row as
//   [later front columns of the joint, dense columns from kRowBegin[joint] on, z]      for a front column,
//   [later dense columns, z]                                                           for a dense column.
// The triangle starts from, and never falls below, d = kFloor: a millionth of the prior's weight. The read-out takes
// that much off the prior, so that it is counted once.
template <class Layout>
class ForgettingFilter {
 public:
  static constexpr int kColumns = Layout::kColumns;
  static constexpr float kFloor = 1e-6f;

  // Work space and result. x, sd [kColumns] in prior units.
  struct ReadOut {
    float x[kColumns] = {};
    float sd[kColumns] = {};
    float ud[math::UdSize(kColumns)] = {};
    int next = 0;
  };

  // Starts without data. The prior must outlive the filter's use of it.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    for (float& d : d_) d = kFloor;
    for (float& r : rows_) r = 0.0f;
  }

  // One whitened row of `joint`. Shapes: front [its front columns], dense [kDense], zero before kRowBegin[joint].
  // With use = false, or when the report is not kOk, every bit of the filter stays; the instructions are the same.
  UpdateReport Update(int joint, const float* front, const float* dense, float y, bool use) {
    const int first = Layout::kFrontBegin[joint], width = Layout::kFrontBegin[joint + 1] - first;
    const int begin = Layout::kRowBegin[joint];
    const int length = width + Layout::kDense - begin + 1;
    float x[kColumns + 1];
    for (int k = 0; k < width; ++k) x[k] = front[k];
    for (int k = begin; k < Layout::kDense; ++k) x[width + k - begin] = dense[k];
    x[length - 1] = y;

    UpdateReport report;
    report.status = JudgeRow(x, length);
    report.accepted = use && report.status == core::Status::kOk;
    if (report.status == core::Status::kOk && !use) report.status = core::Status::kGated;
    const std::uint32_t mask = math::MaskOf(report.accepted);
    for (int k = 0; k < length; ++k) x[k] = math::Masked(x[k], mask);

    float weight = 1.0f;
    for (int k = 0; k < length - 1; ++k) {
      const int column = k < width ? first + k : Layout::kFront + begin + k - width;
      weight = math::GivensRow(d_[column], rows_ + kOffsets.at[column], x[k], x + k + 1, length - 1 - k, weight);
    }
    report.innovation = x[length - 1];
    report.variance = 1.0f / math::Max(weight, 1e-30f);
    return report;
  }

  // Once after the rows of a sample: a front column forgets if its joint moves (bit i of `moving`), a dense column if
  // all move. What stands still keeps all it knows.
  void EndSample(std::uint32_t moving) {
    for (int k = 0; k < kColumns; ++k) {
      const std::uint32_t needed = JointsOf<Layout>(k);
      const float lambda = math::Select((moving & needed) == needed, prior_->lambda[k], 1.0f);
      d_[k] = math::Max(d_[k] * lambda, kFloor);
    }
  }

  // Read-out in kColumns + 1 slices: the prior's factor takes the triangle's rows as measurements of variance 1 / d.
  // Begin, then Step until it answers true. No update between.
  void BeginReadOut(ReadOut& out) const {
    ExpandPrior(*prior_, out.ud);
    for (int k = 0; k < kColumns; ++k) {
      out.ud[math::UdIndex(k, k)] *= 1.0f / (1.0f - kFloor);
      out.x[k] = 0.0f;
    }
    out.next = 0;
  }
  bool StepReadOut(ReadOut& out) const {
    if (out.next < kColumns) {
      TakeRow(out.next++, out);
      return false;
    }
    math::UdDiagonal<kColumns>(out.ud, out.sd);
    for (float& sd : out.sd) sd = math::Sqrt(sd);
    return true;
  }

  const float* weights() const { return d_; }  // [kColumns] d of each row

 private:
  static constexpr int JointOf(int column) {  // of a front column
    int i = 0;
    while (column >= Layout::kFrontBegin[i + 1]) ++i;
    return i;
  }
  struct Offsets {
    int at[kColumns + 1] = {};
    constexpr Offsets() {
      for (int k = 0; k < kColumns; ++k) at[k + 1] = at[k] + RowLength(k);
    }
    static constexpr int RowLength(int k) {
      if (k >= Layout::kFront) return kColumns - k;
      const int joint = JointOf(k);
      return Layout::kFrontBegin[joint + 1] - k + Layout::kDense - Layout::kRowBegin[joint];
    }
  };
  static constexpr Offsets kOffsets{};

  void TakeRow(int column, ReadOut& out) const {
    const float* row = rows_ + kOffsets.at[column];
    float h[kColumns] = {};
    h[column] = 1.0f;
    int k = column + 1;
    if (column < Layout::kFront) {
      const int joint = JointOf(column);
      for (; k < Layout::kFrontBegin[joint + 1]; ++k) h[k] = *row++;
      k = Layout::kFront + Layout::kRowBegin[joint];
    }
    for (; k < kColumns; ++k) h[k] = *row++;

    float f[kColumns], gain[kColumns], innovation = *row;
    for (int i = 0; i < kColumns; ++i) innovation -= h[i] * out.x[i];
    math::UdProject<kColumns>(out.ud, h, f);
    math::UdMeasure<kColumns>(out.ud, f, 1.0f / d_[column], gain);
    for (int i = 0; i < kColumns; ++i) out.x[i] += gain[i] * innovation;
  }

  const Prior<Layout>* prior_ = nullptr;
  float d_[kColumns] = {};
  float rows_[kOffsets.at[kColumns]] = {};
};

}  // namespace armcal::filter
