// filter - a bank of three Kalman filters for friction that changes slowly or suddenly. No program of the project uses
// it yet.
#pragma once

#include "armcal/filter/factor.hpp"
#include "armcal/filter/prior.hpp"
#include "armcal/filter/row.hpp"

namespace armcal::filter {

// How likely each member of a bank is, for each joint, by its innovations. Context: background.
template <int kJoints, int kMembers>
class ModeWeights {
 public:
  void Restart() {
    for (int i = 0; i < kJoints; ++i)
      for (int m = 0; m < kMembers; ++m) weight_[i][m] = 1.0f / kMembers, log_likelihood_[i][m] = 0.0f;
    Average();
  }

  // What a member predicted of a whitened row of the joint. A row that is not used changes nothing.
  void Add(int joint, int member, float innovation, float variance, bool used) {
    const float unlikely = 0.5f * (innovation * innovation / variance + math::Log(variance));
    log_likelihood_[joint][member] -= math::Masked(unlikely, math::MaskOf(used));
  }

  // Bayes' rule over the rows of a sample, for joints that move (bit i: joint i). The weight of a member that is wrong
  // stays at kLeast, so that the member can come back.
  void EndSample(std::uint32_t moving) {
    for (int i = 0; i < kJoints; ++i) {
      float best = log_likelihood_[i][0], sum = 0.0f;
      for (const float l : log_likelihood_[i]) best = math::Max(best, l);
      float next[kMembers];
      for (int m = 0; m < kMembers; ++m) {
        next[m] = math::Max(kLeast, weight_[i][m] * math::Exp(log_likelihood_[i][m] - best));
        log_likelihood_[i][m] = 0.0f;
        sum += next[m];
      }
      for (int m = 0; m < kMembers; ++m)
        weight_[i][m] = math::Select((moving >> i & 1u) != 0u, next[m] / sum, weight_[i][m]);
    }
    Average();
  }

  // The mean of the joints' weights, for the columns that act on several joints.
  void Average() {
    for (int m = 0; m < kMembers; ++m) {
      float sum = 0.0f;
      for (const auto& joint : weight_) sum += joint[m];
      dense_[m] = sum / kJoints;
    }
  }

  // Step 1 of an exchange (IMM). Between two exchanges the friction may change from the behaviour of one member to that
  // of another. Fills in share[to][from]: the weight of the old mean of member `from` in the new mean of member `to`;
  // the sum over `from` is 1. Changes the weights of the joint accordingly, unless `due` is zero. With joint = kJoints
  // it uses the mean weights and does not change them. Call it for kJoints first, then for all joints, then call
  // Average.
  void Exchange(int joint, float (&share)[kMembers][kMembers], std::uint32_t due) {
    float next[kMembers];
    for (int to = 0; to < kMembers; ++to) next[to] = Shares(of(joint), to, share[to]);
    if (joint == kJoints) return;
    for (int m = 0; m < kMembers; ++m) weight_[joint][m] = math::Select(due != 0u, next[m], weight_[joint][m]);
  }

  // The weights [kMembers] of a joint; kJoints: their mean.
  const float* of(int joint) const { return joint < kJoints ? weight_[joint] : dense_; }

 private:
  static constexpr float kStay = 0.995f;  // probability that a mode lasts from one exchange to the next
  static constexpr float kLeast = 1e-4f;

  static float Shares(const float* weight, int to, float* share) {
    float sum = 0.0f;
    for (int from = 0; from < kMembers; ++from) {
      share[from] = weight[from] * (from == to ? kStay : (1.0f - kStay) / (kMembers - 1));
      sum += share[from];
    }
    for (int from = 0; from < kMembers; ++from) share[from] /= sum;
    return sum;
  }

  float weight_[kJoints][kMembers] = {}, log_likelihood_[kJoints][kMembers] = {}, dense_[kMembers] = {};
};

// In each joint, the last front column with process noise has a slope: a second state. In each sample in which the
// joint moves, the slope is added to the column. The three members have different process noise for column and slope.
// For each joint, the innovations of its rows decide the weights of the members. Every kMixEvery samples with motion,
// the means of the members are mixed, as in an IMM (H. Blom, Y. Bar-Shalom, 1988). The covariances are not mixed: this
// would need new factors of all three members, and measurements showed no better tracking. Context of every call:
// background.
template <class Layout>
class ModelBank : public WholeRows<ModelBank<Layout>> {
 public:
  static constexpr bool kExtended = false;
  static constexpr int kColumns = Layout::kColumns, kJoints = Layout::kJoints, kMembers = 3;
  using Columns = Order<Layout, Form::kBlock, Beside::kSlopes>;
  using Estimate = UdEstimate<Columns>;

  struct ReadOut {
    float x[kColumns] = {};
    float sd[kColumns] = {};
    float variance[kMembers][Columns::kSize] = {};
    int member = 0, next = 0;
  };

  // True if only front columns have process noise, and no column is considered.
  static bool Suits(const Prior<Layout>& prior) {
    bool suits = !prior.any_considered;
    for (int k = Layout::kFront; k < kColumns; ++k) suits &= !(prior.noise[k] > 0.0f);
    return suits;
  }

  // Starts at the prior. Suits(prior) must be true, and the prior must not change while the filter works. The prior's
  // process noise only tells which columns change. How fast they change is set by kModes and kOthers.
  void Restart(const Prior<Layout>& prior) {
    prior_ = &prior;
    for (int i = 0; i < kJoints; ++i) {
      drifting_[i] = -1;
      for (int p = Columns::kAt.first[i]; p < Columns::kAt.front_end[i] - 1; ++p) {
        if (prior.noise[Columns::kAt.column[p]] > 0.0f) drifting_[i] = p;
      }
      turn_[i] = 0;
    }
    for (Estimate& e : member_) {
      e.Start(prior);
      for (int i = 0; i < kJoints; ++i)
        e.d(Columns::kAt.front_end[i] - 1) = drifting_[i] < 0 ? 0.0f : kFirstSlope * kFirstSlope;
    }
    weights_.Restart();
    held_ = 0;
    samples_ = 0;
    floor_count_ = 0;
  }

  // Calls and slices are those of the other filters. The innovation and the variance of the report are those of the
  // mixture.
  void BeginRow(int joint, const float* front, const float* dense, float y, bool use) {
    if (held_ == 0)
      for (float& h : rows_) h = 0.0f;
    const std::uint32_t taken =
        FillRow<Layout, Columns, kRowsAtOnce>(joint, front, dense, nullptr, y, use, rows_ + held_, report_[joint]);
    y_[held_] = math::Masked(y, taken);
    row_joint_[held_++] = joint;
    at_ = 0;
    begun_ = false;
  }
  bool StepRow(int& credit) {
    if (held_ == kRowsAtOnce) return StepRows(credit);
    credit -= kRowCost;
    return true;
  }
  bool StepRows(int& credit) {
    if (held_ == 0) return true;
    for (; at_ < kMembers && credit > 0; ++at_) {
      Estimate& e = member_[at_];
      if (!begun_) Begin(e);
      begun_ = !e.StepRows(nullptr, credit);
      if (begun_) return false;
      for (int i = 0; i < held_; ++i)
        weights_.Add(row_joint_[i], at_, e.innovation(i), e.variance(i), report_[row_joint_[i]].accepted);
    }
    if (at_ < kMembers) return false;
    for (int i = 0; i < held_; ++i) Report(i);
    credit -= kRowsCost;
    held_ = 0;
    return true;
  }
  const UpdateReport& report(int joint) const { return report_[joint]; }

  void BeginEnd(std::uint32_t moving) {
    moving_ = moving;
    weights_.EndSample(moving);
    for (Estimate& e : member_) floor_count_ += e.HoldFloor(*prior_);
    at_ = -1;
    samples_ += moving != 0u;  // while all joints rest, nothing changes
  }
  bool StepEnd(int& credit) {
    for (; at_ <= 2 * kJoints && credit > 0; ++at_) {
      const int mixed = 2 * kJoints - at_;
      if (at_ < 0) credit -= kEndCost;
      else if (at_ < kJoints) Predict(at_), credit -= PredictCost(at_);
      else Mix(mixed, math::MaskOf((moving_ != 0u) & (samples_ % kMixEvery == 0u))), credit -= MixCost(mixed);
    }
    return at_ > 2 * kJoints;
  }
  static constexpr int SampleCost() {
    int cost = kMembers * Estimate::kRowsCost + kEndCost + MixCost(kJoints);
    for (int i = 0; i < kJoints; ++i) cost += PredictCost(i) + MixCost(i);
    return cost + (kJoints + 1) / kRowsAtOnce * (kRowCost + kRowsCost);
  }

  // What the bank knew of a joint's front columns no longer counts. See KalmanFilter::BeginReset.
  static constexpr bool CanReset(int block) { return block >= 0 && block < kJoints; }
  void BeginReset(int block) { joint_ = block, at_ = 0; }
  bool StepReset(int& credit) {
    const int first = Columns::kAt.first[joint_], slope = Columns::kAt.front_end[joint_] - 1;
    for (; at_ < kMembers && credit > 0; ++at_) {
      for (int p = first; p < slope; ++p)
        member_[at_].AddUnit(p, math::Masked(1.0f, prior_->active[Columns::kAt.column[p]]), p);
      credit -= (slope - first) * Estimate::Work::SumCost(Columns::kShape, slope);
    }
    return at_ == kMembers;
  }

  void BeginReadOut(ReadOut& out) const {
    for (auto& member : out.variance)
      for (float& v : member) v = 0.0f;
    out.member = out.next = 0;
  }
  // Reads out mean and standard deviation of the mixture.
  bool StepReadOut(ReadOut& out, int& credit) const {
    for (; out.member < kMembers; ++out.member, out.next = 0)
      if (!member_[out.member].AddDiagonal(out.variance[out.member], out.next, credit)) return false;
    for (int k = 0; k < kColumns; ++k) {
      const int p = Columns::kAt.position[k];
      const float* weight = weights_.of(JointOf<Layout>(k));
      out.x[k] = Mean(p, weight);
      float variance = 0.0f;
      for (int m = 0; m < kMembers; ++m) {
        const float apart = member_[m].x(p) - out.x[k];
        variance += weight[m] * (out.variance[m][p] + apart * apart);
      }
      out.sd[k] = math::Sqrt(variance);
    }
    return true;
  }

  float x(int column) const { return Mean(Columns::kAt.position[column], weights_.of(JointOf<Layout>(column))); }
  float weight(int joint, int member) const { return weights_.of(joint)[member]; }
  std::uint32_t floor_count() const { return floor_count_; }
  const Estimate& estimate(int member) const { return member_[member]; }

 private:
  // Steps of a column and of its slope per sample, in standard deviations of the column's prior. They were chosen on
  // other profiles of friction than the tests have.
  struct Mode {
    float walk, slope;
  };
  static constexpr Mode kModes[kMembers] = {{4e-4f, 2e-6f}, {2e-3f, 2e-5f}, {0.06f, 2e-6f}};
  static constexpr float kFirstSlope = 4e-4f;
  static constexpr float kOthers = 0.02f;  // the other front columns of the joint walk less, by this factor
  static constexpr std::uint32_t kMixEvery = 10;

  // Costs, as measured: of a group of rows beside the members' work, of the weights, of a prediction, of a mix.
  static constexpr int kRowCost = 25 + Layout::kDense, kRowsCost = 250;
  static constexpr int kEndCost = 500;
  static constexpr int PredictCost(int i) {
    const int slope = Columns::kAt.front_end[i] - 1;
    return kMembers * (10 + Estimate::Work::SumCost(Columns::kShape, slope) + (Columns::kSize - slope) * 5 / 4);
  }
  static constexpr int MixCost(int i) {
    if (i < kJoints) return 42 + 10 * (Columns::kAt.front_end[i] - Columns::kAt.first[i]);
    return 150 + 10 * Layout::kDense + Columns::kSize - Layout::kDense;
  }

  float Mean(int p, const float* weight) const {
    float sum = 0.0f;
    for (int m = 0; m < kMembers; ++m) sum += weight[m] * member_[m].x(p);
    return sum;
  }
  void Begin(Estimate& e) {
    e.BeginRows();
    float* const row = e.row(0);
    for (int k = 0; k < kRowsAtOnce * Columns::kSize; ++k) row[k] = rows_[k];
    for (int i = 0; i < held_; ++i) e.BeginRow(i, Columns::PlaceOf(row_joint_[i]), y_[i], 1.0f);
  }
  void Report(int i) {
    const float* weight = weights_.of(row_joint_[i]);
    float mean = 0.0f, variance = 0.0f;
    for (int m = 0; m < kMembers; ++m) mean += weight[m] * member_[m].innovation(i);
    for (int m = 0; m < kMembers; ++m) {
      const float apart = member_[m].innovation(i) - mean;
      variance += weight[m] * (member_[m].variance(i) + apart * apart);
    }
    report_[row_joint_[i]].innovation = mean;
    report_[row_joint_[i]].variance = variance;
  }

  // Adds the slope to its column, in x and in U. The slope stands after its column, so this adds rows of U and leaves
  // D. Then adds noise to one front column of the joint. The next sample in which the joint moves serves the next
  // column. So it adds the noise of one full round at once.
  void Predict(int i) {
    const int first = Columns::kAt.first[i], slope = Columns::kAt.front_end[i] - 1, width = slope + 1 - first;
    const std::uint32_t moves = math::MaskOf((moving_ >> i & 1u) != 0u);
    const int p = drifting_[i] < 0 ? slope : drifting_[i], turn = first + turn_[i];
    const float noise = prior_->noise[turn == slope ? 0 : Columns::kAt.column[turn]];  // a slope has none
    const bool walks = (drifting_[i] >= 0) & ((turn == slope) | (noise > 0.0f));
    for (int m = 0; m < kMembers; ++m) {
      Estimate& e = member_[m];
      if (p != slope) {
        e.x(p) += math::Masked(e.x(slope), moves);
        e.u(p, slope) += math::Masked(1.0f, moves);
        for (int later = slope + 1; later < Columns::kSize; ++later)
          if (Columns::kShape.Begin(later) <= p) e.u(p, later) += math::Masked(e.u(slope, later), moves);
      }
      const float walk = math::Select(turn == p, kModes[m].walk, kOthers * kModes[m].walk);
      const float step = math::Select(turn == slope, kModes[m].slope, walk);
      e.AddUnit(turn, math::Masked(step * step * static_cast<float>(width), moves & math::MaskOf(walks)), slope);
    }
    const auto following = static_cast<std::uint32_t>(turn_[i] + 1) & math::MaskOf(turn_[i] + 1 < width);
    turn_[i] = static_cast<std::uint8_t>((following & moves) | (turn_[i] & ~moves));
  }

  // Mixes the members' means: first of the columns that act on several joints (kJoints), then of each joint's own,
  // joint 0 last. It is computed with every sample, so that all samples cost the same. If `due` is zero, it changes
  // nothing.
  void Mix(int i, std::uint32_t due) {
    const bool dense = i == kJoints;
    float share[kMembers][kMembers];
    weights_.Exchange(i, share, due);
    for (int p = dense ? 0 : Columns::kAt.first[i]; p < (dense ? Columns::kSize : Columns::kAt.front_end[i]); ++p) {
      if (dense && Columns::IsFront(p)) continue;
      float before[kMembers];
      for (int m = 0; m < kMembers; ++m) before[m] = member_[m].x(p);
      for (int to = 0; to < kMembers; ++to) {
        float mixed = 0.0f;
        for (int m = 0; m < kMembers; ++m) mixed += share[to][m] * before[m];
        member_[to].x(p) = math::Select(due != 0u, mixed, before[to]);
      }
    }
    if (i == 0) weights_.Average();
  }

  const Prior<Layout>* prior_ = nullptr;
  Estimate member_[kMembers];
  ModeWeights<kJoints, kMembers> weights_;
  float rows_[kRowsAtOnce * Columns::kSize] = {}, y_[kRowsAtOnce] = {};  // rows that wait for the members
  int row_joint_[kRowsAtOnce] = {}, held_ = 0;
  int drifting_[kJoints] = {};
  std::uint8_t turn_[kJoints] = {};
  UpdateReport report_[kJoints];
  std::uint32_t moving_ = 0, samples_ = 0, floor_count_ = 0;
  int joint_ = 0, at_ = 0;
  bool begun_ = false;
};

}  // namespace armcal::filter
