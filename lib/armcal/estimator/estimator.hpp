// estimator - feeds the samples of an intake to a filter, and publishes the estimates.
#pragma once

#include <type_traits>

#include "armcal/core/mailbox.hpp"
#include "armcal/estimator/estimates.hpp"
#include "armcal/estimator/intake.hpp"
#include "armcal/estimator/live_model.hpp"
#include "armcal/estimator/row_gate.hpp"
#include "armcal/math/columns.hpp"

namespace armcal::estimator {

// One joint's row at one sample, whitened and in prior units: all numbers have unit 1.
template <class Model>
struct Row {
  float front[Model::kFront > 0 ? Model::kFront : 1] = {};  // from the joint's first column on
  float dense[Model::kDense > 0 ? Model::kDense : 1] = {};  // from kRowBegin[joint] on; the rest is not of this row
  float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};  // extended filter only
  float y = 0.0f;
};

// Fills in front, dense and y = residual_Nm / sigma, where residual_Nm is the measured torque minus the one at b0.
// seen: the regressor that the filter uses. One copy serves all estimators of a model. Context: background.
template <class Model>
ARMCAL_NOINLINE void FillRow(const AdoptedTable<Model>& table, const model::Rows<Model>& seen, int joint,
                             float residual_Nm, Row<Model>& row) {
  const int first = Model::kFrontBegin[joint], end = Model::kFrontBegin[joint + 1];
  const float whiten = 1.0f / table.sigma_Nm[joint];
  const auto scaled = [&](float value, int column) {
    return math::Masked(value * (table.scale[column] * whiten), table.prior.active[column]);
  };
  for (int k = first; k < end; ++k) row.front[k - first] = scaled(seen.front[k], k);
  for (int k = Model::kRowBegin[joint]; k < Model::kDense; ++k)
    row.dense[k] = scaled(seen.dense[joint * Model::kDense + k], Model::kFront + k);
  row.y = residual_Nm * whiten;
}

// Feeds the samples of an intake to one filter.
// Filter: filter::ForgettingFilter<Model>, filter::ModelBank<Model>, filter::KalmanFilter<Model> or
// filter::ExtendedKalmanFilter<Model>; the last two in either form.
// Source: Intake<Model>, if the estimator has an intake of its own; Intake<Model>&, if several estimators share one.
// Context: tick for Push and PushSample (use one of the two) and for tick_gaps; any for Take, refused_samples, pending
// and implausible; background for all others.
template <class Model, class Filter, class Source = Intake<Model>>
class Estimator {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kRingSamples = Intake<Model>::kRingSamples;
  // Step calls it once for each sample, after its rows. sample.flags has kUsed for each row that changed the estimate.
  // tau_model_Nm [n]: the torque of the committed model. Context: background.
  using Observer = void (*)(void* context, const model::Sample<n>& sample, const float* tau_model_Nm);

  Estimator() = default;
  template <class Shared, class = std::enable_if_t<std::is_same_v<Shared&, Source>>>
  explicit Estimator(Shared& intake) : intake_(intake) {}

  // As Intake::Push and Intake::PushSample. Where several estimators share an intake, call those, once.
  core::Status Push(const model::RawSample<n>& raw) { return intake_.Push(raw); }
  core::Status PushSample(const model::Sample<n>& sample) { return intake_.PushSample(sample); }

  // Returns false if the filter's form cannot represent what the table asks for (see filter::Form). Do not adopt such a
  // table.
  static bool Suits(const AdoptedTable<Model>& table) { return Filter::Suits(table.prior); }

  // Restarts filter, statistics and signal path from `table`. Suits(table) must be true, and the table must not change
  // until the next Adopt. Its generation must differ from the one before and from 0. Samples made before are dropped.
  // adopted_tick: zero of the model's time. Where several estimators share an intake, call Intake::Adopt once, then
  // Restart of each. Context: background.
  void Adopt(const AdoptedTable<Model>& table, std::uint32_t adopted_tick) {
    Restart(table, adopted_tick);
    intake_.Adopt(table, adopted_tick);
  }
  // The same for filter and statistics, without the intake. Context: background.
  void Restart(const AdoptedTable<Model>& table, std::uint32_t adopted_tick) {
    table_ = &table;
    stands_ = false;
    filter_.Restart(table.prior);
    estimates_ = Estimates<Model>{};
    estimates_.generation = table.committed.generation;
    statistics_.Restart(adopted_tick);
    gate_.Restart();
    period_ = adopted_tick / Model::kSampleTicks / publish_every_;
    known_due_ = true;
    if constexpr (Filter::kExtended) live_.Restart();
    stage_ = Stage::kIdle;
    credit_ = 0;
    resets_due_ = 0;
    slice_ = filter::EqualSlices(filter_.SampleCost() + kSampleCost + kGateCost + n * kRowCost);
    read_out_due_ = true;
  }

  // Works until `budget` is spent. The unit is one element of a filter's column, which is eight instructions on a
  // Cortex-M4F. The work on one column or one regressor is not divided. If it costs more than what is left, the next
  // call gets less. Returns false if there was nothing to do. An interrupt may stop it anywhere. Context: background.
  bool Step(int budget) {
    credit_ += budget;
    bool worked = false;
    while (credit_ > 0) {
      if (!Advance()) {
        credit_ = 0;  // an idle estimator saves nothing up
        return worked;
      }
      worked = true;
    }
    return true;
  }
  // One slice. A sample's work is divided into equal slices, whichever rows they hold.
  bool Step() { return Step(slice_); }

  // hold = true: from the next sample on, rows do not change the estimate, and it does not forget. hold = false: they
  // do again. Statistics go on. An adoption does not end a hold. Context: background.
  void Hold(bool hold) { hold_ = hold; }

  // From the next sample on, what was known of one part no longer counts: after work on that joint, or with another
  // payload. block: a joint (its own columns), or n: the links and what else acts on several joints. kOutOfRange: there
  // is no such part, or the filter's form cannot reset it; then only Adopt helps, which restarts all. Context:
  // background.
  core::Status Reset(int block) {
    if (!Filter::CanReset(block)) return core::Status::kOutOfRange;
    resets_due_ |= 1u << block;
    return core::Status::kOk;
  }

  // Copies the latest published estimates to `out`. Returns false if nothing is new since the last call. Context: any,
  // but one reader only.
  bool Take(Estimates<Model>& out) { return published_.Take(out); }

  // Asks for a read-out after the present sample, in addition to the periodic ones. Context: background.
  void RequestReadOut() { read_out_due_ = true; }
  // How often estimates are published without a request. A period is `samples` samples long and is counted from tick 0.
  // The estimates are published after the first sample of each period. The row gate uses these estimates and the first
  // ones after a restart, not those of RequestReadOut. Context: background.
  void SetPublishEvery(std::uint32_t samples) { publish_every_ = math::Max<std::uint32_t>(samples, 1); }
  // nullptr: no observer. Context: background.
  void SetObserver(Observer observer, void* context) {
    observer_ = observer;
    observer_context_ = context;
  }

  // The residual statistics to fill from now on and to restart with each adoption; nullptr: none. They do not depend on
  // the filter, so it is enough to give them to one of several estimators. Context: background.
  void SetResiduals(monitor::ResidualStatistics<n>* residuals) { statistics_.SetResiduals(residuals); }

  // Counts of the intake. Context: any, where no other is named.
  std::uint32_t refused_samples() const { return intake_.refused(); }
  std::uint32_t pending() const { return intake_.pending(); }          // samples waiting for Step
  std::uint32_t implausible() const { return intake_.implausible(); }  // ticks with a refused count or current
  std::uint32_t tick_gaps() const { return intake_.tick_gaps(); }      // restarts of the signal path; context: tick

  const Filter& filter() const { return filter_; }
  // The filter's finished read-out, for BeginPhysical. nullptr: there is none yet, one is being computed, or rows have
  // come in since. Context: background.
  const typename Filter::ReadOut* read_out() const { return stands_ ? &read_out_ : nullptr; }
  // How many read-outs have been finished. Context: background.
  std::uint32_t read_outs() const { return read_outs_; }

 private:
  enum class Stage : std::uint8_t {
    kIdle,
    kRow,
    kUpdate,
    kRows,
    kReport,
    kEnd,
    kReset,
    kBeginReadOut,
    kReadOut,
    kPublish
  };
  // Credit of a sample's regressor, and of a row's whitening and statistics: from counts of six-axis models.
  static constexpr int kSampleCost = Intake<Model>::kEvaluationCost, kRowCost = 5 * Model::kDense / 2;
  static constexpr int kGateCost = 5 * n * Model::kDense / 2;  // of both torques of all rows, and of the gate

  // Of the beginning of a read-out, and of its publication.
  static constexpr int kReadOutCost = 25 * Model::kColumns;

  struct Nothing {};

  // Does the next piece of work that is not divided. Returns false if there is none.
  bool Advance() {
    switch (stage_) {
      case Stage::kIdle:
        return StartSample();
      case Stage::kRow:
        BeginRow();
        return true;
      case Stage::kUpdate:
        if (filter_.StepRow(credit_)) stage_ = ++joint_ < n ? Stage::kRow : Stage::kRows;
        return true;
      case Stage::kRows:
        if (filter_.StepRows(credit_)) joint_ = 0, stage_ = Stage::kReport;
        return true;
      case Stage::kReport:
        ReportRow();
        if (++joint_ == n) EndRows();
        return true;
      case Stage::kEnd:
        if (filter_.StepEnd(credit_)) FinishSample();
        return true;
      case Stage::kReset:
        if (filter_.StepReset(credit_)) stage_ = Stage::kIdle;
        return true;
      case Stage::kBeginReadOut:
        filter_.BeginReadOut(read_out_);
        credit_ -= kReadOutCost;
        stage_ = Stage::kReadOut;
        return true;
      case Stage::kReadOut:
        if (filter_.StepReadOut(read_out_, credit_)) {
          stage_ = Stage::kPublish;
          credit_ = math::Min(credit_, 0);  // Publish() cannot be divided, so it starts with a new slice
        }
        return true;
      case Stage::kPublish:
        Publish();
        credit_ -= kReadOutCost;
        return true;
    }
    return false;
  }

  // Resets and read-outs come before the next sample.
  bool StartSample() {
    if (table_ != nullptr && resets_due_ != 0u) {
      BeginReset();
      return true;
    }
    if (table_ != nullptr && read_out_due_) {
      read_out_due_ = false;
      stands_ = false;
      stage_ = Stage::kBeginReadOut;
      if (credit_ < slice_) credit_ = math::Min(credit_, 0);  // as at kPublish
      return true;
    }
    if (!intake_.Next(reader_, credit_)) return false;
    stands_ = false;
    if constexpr (Filter::kExtended) {
      credit_ -= kSampleCost;
      live_.Linearise(*table_, filter_, intake_.input(), intake_.gap());
    }
    JudgeRows();
    credit_ -= kGateCost;
    updating_ = hold_ ? 0u : intake_.moving() & ~outside_;
    used_ = 0;
    joint_ = 0;
    stage_ = Stage::kRow;
    return true;
  }

  // Decides which rows of the sample are outside the gate, from what was known before the sample.
  void JudgeRows() {
    outside_ = 0;
    for (int i = 0; i < n; ++i) {
      const float tau_Nm = intake_.sample().tau[i], whiten = 1.0f / table_->sigma_Nm[i];
      load_Nm_[i] = model::LoadTorque(table_->committed.p, intake_.rows(), i);
      tau_model_Nm_[i] = model::RowTorque(table_->committed.p, intake_.rows(), i, load_Nm_[i]);
      residual_Nm_[i] = tau_Nm - tau_model_Nm_[i];
      const float known_Nm = model::RowTorque(known_, FilterRows(), i);
      const bool moves = ((intake_.moving() >> i) & 1u) != 0u;
      const bool inside = gate_.Admit(i, residual_Nm_[i] * whiten, (tau_Nm - known_Nm) * whiten, moves,
                                      intake_.sample().qd[i] > 0.0f, table_->gate_sigma[i]);
      outside_ |= static_cast<std::uint32_t>(moves & !inside) << i;
    }
  }

  void BeginReset() {
    int block = 0;
    while ((resets_due_ >> block & 1u) == 0u) ++block;
    resets_due_ &= ~(1u << block);
    stands_ = false;
    statistics_.ForgetInnovations();
    filter_.BeginReset(block);
    stage_ = Stage::kReset;
  }

  void BeginRow() {
    const bool use = ((updating_ >> joint_) & 1u) != 0u;
    FillRow(*table_, FilterRows(), joint_, residual_Nm_[joint_], row_);
    if constexpr (Filter::kExtended) {
      live_.CompleteRow(*table_, joint_, intake_.sample().tau[joint_], row_);
      filter_.BeginRow(joint_, row_.front, row_.dense, row_.y, use, row_.eta);
    } else {
      filter_.BeginRow(joint_, row_.front, row_.dense, row_.y, use);
    }
    credit_ -= kRowCost;
    stage_ = Stage::kUpdate;
  }

  const model::Rows<Model>& FilterRows() const {
    if constexpr (Filter::kExtended) return live_.rows();
    else return intake_.rows();
  }

  void ReportRow() {
    const int i = joint_;
    const filter::UpdateReport& report = filter_.report(i);
    used_ |= static_cast<std::uint32_t>(report.accepted) << i;
    const bool moves = ((intake_.moving() >> i) & 1u) != 0u;
    estimates_.rows_outside[i] += (outside_ >> i) & 1u;
    statistics_.Add(i, report, residual_Nm_[i], load_Nm_[i], intake_.sample(), moves, estimates_);
  }

  void EndRows() {
    if constexpr (Filter::kExtended)
      for (int e = 0; e < Model::kNonlinear; ++e)
        filter_.Clamp(Model::kColumns + e, table_->eta_low[e], table_->eta_high[e]);
    filter_.BeginEnd(updating_);
    stage_ = Stage::kEnd;
  }

  void FinishSample() {
    const std::uint32_t tick = intake_.sample().tick;
    const std::uint32_t period = tick / Model::kSampleTicks / publish_every_;
    if (period != period_) read_out_due_ = known_due_ = true;
    period_ = period;
    statistics_.EndSample(tick);
    estimates_.tick = tick;
    if (observer_ != nullptr) Observe();
    intake_.Done(reader_);
    ++estimates_.samples;
    stage_ = Stage::kIdle;
  }

  // Sets kUsed by this estimator's rows. The sample may have come with other flags.
  void Observe() {
    model::Sample<n> sample = intake_.sample();
    for (int i = 0; i < n; ++i) {
      const bool used = ((used_ >> i) & 1u) != 0u;
      sample.flags[i] = static_cast<std::uint8_t>((sample.flags[i] & ~model::kUsed) | (used ? model::kUsed : 0));
    }
    observer_(observer_context_, sample, tau_model_Nm_);
  }

  void Publish() {
    FromPriorUnits(*table_, read_out_, estimates_);
    for (int c = 0; c < Model::kColumns && known_due_; ++c) known_[c] = estimates_.value[c];
    known_due_ = false;
    if constexpr (Filter::kExtended) estimates_.clamps = filter_.clamp_count();
    statistics_.Publish(estimates_);
    estimates_.stale = intake_.stale();
    estimates_.refused = intake_.refused();
    published_.Post(estimates_);
    stands_ = true;
    ++read_outs_;
    stage_ = Stage::kIdle;
  }

  Source intake_;
  core::Mailbox<Estimates<Model>> published_;

  const AdoptedTable<Model>* table_ = nullptr;  // the background's, from here on
  Filter filter_;
  typename Filter::ReadOut read_out_;
  std::conditional_t<Filter::kExtended, LiveModel<Model>, Nothing> live_;
  Row<Model> row_;
  RowStatistics<Model> statistics_;
  RowGate<n> gate_;
  Estimates<Model> estimates_;
  // Per joint, N m, by the committed table: torque of the dense columns; torque of all columns; measured torque minus
  // the second.
  float load_Nm_[n] = {}, tau_model_Nm_[n] = {}, residual_Nm_[n] = {};
  // The estimates that the gate uses. They change after a restart and with the first sample of each period, not when a
  // client asks for a read-out. Periods are counted in ticks. So a PC program that starts with a later sample has the
  // same periods as the drive.
  float known_[Model::kColumns] = {};
  std::uint32_t period_ = 0;
  int credit_ = 0, slice_ = filter::kSliceCredit;
  const std::uint32_t reader_ = intake_.Join();  // this estimator's bit
  std::uint32_t updating_ = 0, used_ = 0;        // joints, a bit each: rows that may change the estimate, and that did
  std::uint32_t outside_ = 0;                    // rows that the gate refuses
  std::uint32_t resets_due_ = 0;                 // blocks, a bit each
  std::uint32_t read_outs_ = 0;
  std::uint32_t publish_every_ = 125;
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
  int joint_ = 0;
  Stage stage_ = Stage::kIdle;
  bool read_out_due_ = false;
  bool known_due_ = false;  // the next read-out is the gate's
  bool hold_ = false;
  bool stands_ = false;  // nothing has changed since the read-out
};

}  // namespace armcal::estimator
