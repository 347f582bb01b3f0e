// filter - the Kalman filter of constant parameters with process noise; and the extended one.
#pragma once

#include "armcal/filter/factor.hpp"
#include "armcal/filter/prior.hpp"
#include "armcal/filter/row.hpp"

namespace armcal::filter {

// Counts the samples in which each joint moves, and those in which all of them do. moving: bit i for joint i. Shape:
// moved [joints + 1], the last one for all; the counts wrap. One copy serves all filters. Context: background.
ARMCAL_NOINLINE inline void CountMoving(std::uint32_t moving, int joints, std::uint8_t* moved) {
  const std::uint32_t all = (1u << joints) - 1u;
  for (int i = 0; i < joints; ++i) moved[i] = static_cast<std::uint8_t>(moved[i] + (moving >> i & 1u));
  moved[joints] = static_cast<std::uint8_t>(moved[joints] + ((moving & all) == all));
}

// Takes the rows of a sample in their order, two at a time. Process noise is added by rank-one sums. `considered`
// columns follow Schmidt's form. After each sample, noise is added to one column only, and the next sample serves the
// next column. It is the noise of all samples since the column's last turn in which its joints have moved. The state is
// [front, dense], and in an extended filter eta after it. Every call is bounded. Context: background.
template <class Layout, Form form = Form::kDense, Beside beside = Beside::kNothing>
class KalmanFilter : public WholeRows<KalmanFilter<Layout, form, beside>> {
 public:
  static constexpr bool kExtended = beside == Beside::kEta;  // rows carry d tau / d eta after the columns
  using Columns = Order<Layout, form, beside>;
  using Estimate = UdEstimate<Columns>;
  static constexpr int kSize = Columns::kSize;

  // The estimate in prior units and its standard deviation, by column. variance and next are work space.
  struct ReadOut {
    float x[kSize] = {};
    float sd[kSize] = {};
    float variance[kSize] = {};
    int next = 0;
  };

  // Returns true if the form can represent what the prior asks for. The dense form always can.
  static bool Suits(const Prior<Layout>& prior) {
    if (form == Form::kDense) return true;
    bool suits = true;
    for (int k = 0; k < kSize; ++k) suits &= !prior.considered[k] && (k < Layout::kFront || !(prior.noise[k] > 0.0f));
    return suits;
  }

  // Starts at the prior. Suits(prior) must be true, and the prior must not change while the filter works.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    estimate_.Start(prior);
    turns_ = 0;
    held_ = 0;
    last_noise_ = 0;
    for (std::uint32_t& word : considered_) word = 0;
    for (int p = 0; p < kSize; ++p) {
      const int k = Columns::kAt.column[p];
      if (prior.noise[k] > 0.0f) turn_[turns_++] = static_cast<std::uint8_t>(p), last_noise_ = p;
      considered_[p / 32] |= static_cast<std::uint32_t>(prior.considered[k]) << (p % 32);
    }
    next_turn_ = 0;
    for (std::uint8_t& moved : moved_) moved = 0;
    for (std::uint8_t& moved : at_turn_) moved = 0;
    floor_count_ = 0;
    clamp_count_ = 0;
  }

  // One whitened row of `joint`. Shapes: front [the joint's front columns]; dense [kDense], zero before
  // kRowBegin[joint]; eta [kNonlinear], in an extended filter only. If use is false or the report is not kOk, no bit of
  // the estimate changes, and the instructions are the same. After BeginRow call StepRow, which spends credit
  // (slices.hpp), until it returns true; after the last row of the sample, StepRows likewise. Then report().
  void BeginRow(int joint, const float* front, const float* dense, float y, bool use, const float* eta = nullptr) {
    if (held_ == 0) estimate_.BeginRows();
    const std::uint32_t taken =
        FillRow<Layout, Columns, kRowsAtOnce>(joint, front, dense, eta, y, use, estimate_.row(held_), report_[joint]);
    estimate_.BeginRow(held_, Columns::PlaceOf(joint), math::Masked(y, taken), 1.0f);
    joint_[held_++] = static_cast<std::uint8_t>(joint);
  }
  bool StepRow(int& credit) {
    // Schmidt's form changes the covariance after each row, so rows cannot be taken together.
    if (held_ == kRowsAtOnce || AnyConsidered()) return StepRows(credit);
    credit -= kRowCost;
    return true;
  }
  bool StepRows(int& credit) {
    if (held_ == 0) return true;
    if (!estimate_.StepRows(AnyConsidered() ? considered_ : nullptr, credit)) return false;
    for (int i = 0; i < held_; ++i) {
      report_[joint_[i]].innovation = estimate_.innovation(i);
      report_[joint_[i]].variance = estimate_.variance(i);
    }
    held_ = 0;
    return true;
  }
  const UpdateReport& report(int joint) const { return report_[joint]; }

  // The cost of the rows and the end of a sample (slices.hpp). A considered column makes it larger.
  int SampleCost() const {
    const int sum = turns_ > 0 ? Estimate::Work::SumCost(Columns::kShape, last_noise_) : 0;
    if (AnyConsidered())
      return kEndCost + Estimate::kSingleRowsCost +
             Layout::kJoints * Estimate::Work::SumCost(Columns::kShape, kSize - 1) + sum;
    return kEndCost + Layout::kJoints / kRowsAtOnce * kRowCost + Estimate::kRowsCost + sum;
  }

  // Once after the rows of a sample: adds process noise, and holds the floor under the dense D. Bit i of `moving`:
  // joint i moves.
  void BeginEnd(std::uint32_t moving) {
    floor_count_ += estimate_.HoldFloor(*prior_);
    if (turns_ == 0) return;
    CountMoving(moving, Layout::kJoints, moved_);
    const int p = turn_[next_turn_], k = Columns::kAt.column[p];
    std::uint8_t& last = at_turn_[next_turn_];
    const std::uint8_t now = moving != 0u ? moved_[JointOf<Layout>(k)] : last;  // while all joints rest, no turn passes
    const auto samples = static_cast<std::uint8_t>(now - last);
    last = now;
    estimate_.BeginUnitSum(p, prior_->noise[k] * static_cast<float>(samples), LastOf(k));
    const int following = next_turn_ + 1 < turns_ ? next_turn_ + 1 : 0;
    next_turn_ = moving != 0u ? following : next_turn_;
  }
  bool StepEnd(int& credit) {
    if (turns_ > 0 && !estimate_.StepSum(credit)) return false;
    credit -= kEndCost;
    return true;
  }

  // What the filter knew of one part of the columns no longer counts: the prior's variance is added to the variance of
  // its columns. The estimate stays until data move it. block: a joint (its front columns), or kJoints (all others),
  // which the block form cannot reset. Only between samples. After BeginReset call StepReset, which spends credit,
  // until it returns true.
  static constexpr bool CanReset(int block) {
    return block >= 0 && (form == Form::kDense ? block <= Layout::kJoints : block < Layout::kJoints);
  }
  void BeginReset(int block) {
    reset_ = ColumnsOfBlock<Layout>(block, kSize);
    BeginResetColumn();
  }
  bool StepReset(int& credit) {
    while (reset_.begin < reset_.end && credit > 0) {
      if (!estimate_.StepSum(credit)) continue;
      ++reset_.begin;
      BeginResetColumn();
    }
    return reset_.begin == reset_.end;
  }

  // Read-out in slices, the same for all filters: BeginReadOut, then StepReadOut until it returns true. The filter must
  // not take a row in between.
  void BeginReadOut(ReadOut& out) const {
    for (float& v : out.variance) v = 0.0f;
    out.next = 0;
  }
  bool StepReadOut(ReadOut& out, int& credit) const {
    if (!estimate_.AddDiagonal(out.variance, out.next, credit)) return false;
    for (int p = 0; p < kSize; ++p) {
      out.x[Columns::kAt.column[p]] = estimate_.x(p);
      out.sd[Columns::kAt.column[p]] = math::Sqrt(out.variance[p]);
    }
    return true;
  }

  float x(int column) const { return estimate_.x(Columns::kAt.position[column]); }
  // Keeps x of a column within [low, high] (prior units), and counts how often it had to. Only between samples.
  void Clamp(int column, float low, float high) {
    float& x = estimate_.x(Columns::kAt.position[column]);
    clamp_count_ += !(x >= low && x <= high);
    x = math::Max(low, math::Min(high, x));
  }
  std::uint32_t clamp_count() const { return clamp_count_; }
  std::uint32_t floor_count() const { return floor_count_; }  // how often a D was raised to the floor
  const Estimate& estimate() const { return estimate_; }

 private:
  static constexpr int kEndCost = 120, kRowCost = 25 + Layout::kDense;

  void BeginResetColumn() {
    if (reset_.begin == reset_.end) return;
    const int p = Columns::kAt.position[reset_.begin];
    estimate_.BeginUnitSum(p, math::Masked(1.0f, prior_->active[reset_.begin]), p);
  }

  bool AnyConsidered() const { return form == Form::kDense && prior_->any_considered; }

  // Where a sum of process noise starts. Dense form: at the last column with process noise, so all sums take the same
  // instructions. Block form: at the last front column of the joint, so the instructions depend on the joint alone.
  int LastOf(int column) const {
    return form == Form::kBlock ? Columns::kAt.front_end[JointOf<Layout>(column)] - 1 : last_noise_;
  }

  const Prior<Layout>* prior_ = nullptr;
  Estimate estimate_;
  UpdateReport report_[Layout::kJoints];
  std::uint8_t joint_[kRowsAtOnce] = {};  // of the rows that wait to be taken together
  int held_ = 0;                          // so many wait
  std::uint32_t considered_[(kSize + 31) / 32] = {};
  std::uint8_t turn_[kSize] = {};  // positions with noise
  int turns_ = 0, next_turn_ = 0, last_noise_ = 0;
  // Samples with motion (CountMoving), now and at the last turn of each position. A turn comes before they wrap.
  std::uint8_t moved_[Layout::kJoints + 1] = {}, at_turn_[kSize] = {};
  ColumnRange reset_ = {};  // what remains of a reset
  std::uint32_t floor_count_ = 0, clamp_count_ = 0;
};

// The Kalman filter over [front, dense, eta]. The caller linearises the rows at the estimate before the sample: y = tau
// - tau(x0) + h x0, where h = [columns, d tau / d eta] at x0. estimator/live_model.hpp does this. eta counts as dense
// columns. So the block form suits if only front columns have process noise and no column is considered.
template <class Layout, Form form = Form::kDense>
using ExtendedKalmanFilter = KalmanFilter<Layout, form, Beside::kEta>;

}  // namespace armcal::filter
