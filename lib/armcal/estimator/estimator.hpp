// estimator - where model and filter meet: samples in, estimates out; knows no register and no storage.
#pragma once

#include "armcal/core/mailbox.hpp"
#include "armcal/estimator/estimates.hpp"
#include "armcal/estimator/image.hpp"
#include "armcal/estimator/intake.hpp"
#include "armcal/estimator/row_statistics.hpp"
#include "armcal/estimator/sample_rows.hpp"
#include "armcal/filter/row.hpp"
#include "armcal/filter/slices.hpp"

namespace armcal::estimator {

// Filter: filter::ForgettingFilter<Model>, filter::ModelBank<Model>, filter::KalmanFilter<Model>,
// filter::ExtendedKalmanFilter<Model>, the last two in either form.
// Push and PushSample belong to the tick (use one of the two), everything else to the background.
template <class Model, class Filter>
class Estimator {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kRingSamples = Intake<Model>::kRingSamples;
  // Called once a sample after its rows: flags carry kUsed where a row changed the estimate.
  using Observer = void (*)(void* context, const model::Sample<n>& sample, const float* tau_model_Nm);

  // One control tick. kOk; kFull: a sample became ready and was refused whole because the background is late
  // (counted). Context: tick.
  core::Status Push(const model::RawSample<n>& raw) { return intake_.Push(raw); }

  // A sample that a signal path made elsewhere (torque scale and flags already inside); the rest is bit for bit the
  // same. kFull as above. Context: tick, or a host's only thread.
  core::Status PushSample(const model::Sample<n>& sample) { return intake_.PushSample(sample); }

  // False: the filter's form cannot hold what the table asks for (see filter::Form); a table transaction refuses it.
  static bool Suits(const Image<Model>& image) { return Filter::Suits(image.prior); }

  // Restarts filter, statistics and signal path from `image`, which must suit and stay as it is until the next Adopt;
  // its generation must differ from the one before and from 0. Samples made before are dropped. adopted_tick: zero of
  // the model's time. Context: background.
  void Adopt(const Image<Model>& image, std::uint32_t adopted_tick) {
    image_ = &image;
    stands_ = false;
    filter_.Restart(image.prior);
    estimates_ = Estimates<Model>{};
    estimates_.generation = image.committed.generation;
    statistics_.Restart(adopted_tick);
    rows_.Restart(image, adopted_tick);
    stage_ = Stage::kIdle;
    credit_ = 0;
    resets_due_ = 0;
    slice_ = filter::EqualSlices(filter_.SampleCost() + kSampleCost + n * kRowCost);
    read_out_due_ = true;
    intake_.Adopt(image.committed);
  }

  // Works until `budget` is spent, in elements of a filter's columns: eight instructions each on a Cortex-M4F. A column
  // or a regressor is not cut; what it takes too much is taken off the next call. False: nothing to do.
  // May be interrupted anywhere. Context: background.
  bool Step(int budget) {
    credit_ += budget;
    bool worked = false;
    while (credit_ > 0) {
      if (!Advance()) {
        credit_ = 0;  // no saving up
        return worked;
      }
      worked = true;
    }
    return true;
  }
  // One slice: a sample's work is cut into equal ones, whichever rows they hold.
  bool Step() { return Step(slice_); }

  // True: rows no longer change the estimate, and it does not forget; statistics go on. An adoption leaves it as it is.
  // From the next sample on. Context: background.
  void Hold(bool hold) { hold_ = hold; }

  // What is known of a block no longer counts, from the next sample on: after work on that joint, or another payload.
  // block: a joint (its own columns), or n: the links and what else acts on several joints. kOutOfRange: there is no
  // such block, or the filter's form cannot reset it (Adopt restarts all). Context: background.
  core::Status Reset(int block) {
    if (!Filter::CanReset(block)) return core::Status::kOutOfRange;
    resets_due_ |= 1u << block;
    return core::Status::kOk;
  }

  // Latest published estimates; false: nothing new since the last call. Context: one reader, any.
  bool Take(Estimates<Model>& out) { return published_.Take(out); }

  // Publish after the sample in work, besides every `publish_every` samples. Context: background.
  void RequestReadOut() { read_out_due_ = true; }
  void SetPublishEvery(std::uint32_t samples) { publish_every_ = math::Max<std::uint32_t>(samples, 1); }
  void SetObserver(Observer observer, void* context) {
    observer_ = observer;
    observer_context_ = context;
  }

  // Statistics to fill from now on and to restart with each adoption; nullptr: none. They do not depend on the filter,
  // so one of two estimators is enough.
  void SetResiduals(monitor::ResidualStatistics<n>* residuals) { statistics_.SetResiduals(residuals); }

  std::uint32_t refused_samples() const { return intake_.refused(); }
  std::uint32_t pending() const { return intake_.pending(); }      // samples waiting for Step; context: any
  std::uint32_t tick_gaps() const { return intake_.tick_gaps(); }  // restarts of the signal path; context: tick
  const Filter& filter() const { return filter_; }
  // The filter's finished read-out, for BeginPhysical; nullptr: rows have come in since. Context: background.
  const typename Filter::ReadOut* read_out() const { return stands_ ? &read_out_ : nullptr; }

 private:
  enum class Stage : std::uint8_t { kIdle, kRow, kUpdate, kEnd, kReset, kReadOut };
  // What a sample's regressor and a row's whitening and statistics are worth, from counts of six-axis models.
  static constexpr int kSampleCost = n * Model::kDense, kRowCost = 3 * Model::kDense;

  // The next indivisible piece of work; false: there is none.
  bool Advance() {
    switch (stage_) {
      case Stage::kIdle:
        return StartSample();
      case Stage::kRow:
        BeginRow();
        return true;
      case Stage::kUpdate:
        if (filter_.StepRow(credit_)) FinishRow();
        return true;
      case Stage::kEnd:
        if (filter_.StepEnd(credit_)) FinishSample();
        return true;
      case Stage::kReset:
        if (filter_.StepReset(credit_)) stage_ = Stage::kIdle;
        return true;
      case Stage::kReadOut:
        if (filter_.StepReadOut(read_out_, credit_)) Publish();
        return true;
    }
    return false;
  }

  bool StartSample() {
    if (image_ != nullptr && resets_due_ != 0u) {
      BeginReset();
      return true;
    }
    if (image_ != nullptr && read_out_due_) {
      read_out_due_ = false;
      stands_ = false;
      filter_.BeginReadOut(read_out_);
      stage_ = Stage::kReadOut;
      return true;
    }
    if (!core::IsOk(intake_.Pop(item_))) return false;
    stands_ = false;
    credit_ -= Filter::kExtended ? 2 * kSampleCost : kSampleCost;
    if (image_ == nullptr || item_.generation != image_->committed.generation) {
      ++estimates_.stale;
      return true;
    }
    moving_ = rows_.Evaluate(item_.sample, filter_);
    updating_ = hold_ ? 0u : moving_;
    joint_ = 0;
    stage_ = Stage::kRow;
    return true;
  }

  void BeginReset() {
    int block = 0;
    while ((resets_due_ >> block & 1u) == 0u) ++block;
    resets_due_ &= ~(1u << block);
    stands_ = false;
    statistics_.ForgetSurprise();
    filter_.BeginReset(block);
    stage_ = Stage::kReset;
  }

  void BeginRow() {
    rows_.Whiten(joint_, item_.sample.tau[joint_]);
    const auto& row = rows_.row();
    const bool use = ((updating_ >> joint_) & 1u) != 0u;
    if constexpr (Filter::kExtended) filter_.BeginRow(joint_, row.front, row.dense, row.y, use, row.eta);
    else filter_.BeginRow(joint_, row.front, row.dense, row.y, use);
    tau_model_Nm_[joint_] = row.model_Nm;
    credit_ -= kRowCost;
    stage_ = Stage::kUpdate;
  }

  void FinishRow() {
    const int i = joint_;
    const filter::UpdateReport& report = filter_.report();
    item_.sample.flags[i] =
        static_cast<std::uint8_t>((item_.sample.flags[i] & ~model::kUsed) | (report.accepted ? model::kUsed : 0));
    const auto& row = rows_.row();
    statistics_.Add(i, report, row.residual_Nm, row.load_Nm, item_.sample, ((moving_ >> i) & 1u) != 0u, estimates_);
    stage_ = ++joint_ == n ? Stage::kEnd : Stage::kRow;
    if (stage_ == Stage::kEnd) EndRows();
  }

  void EndRows() {
    if constexpr (Filter::kExtended)
      for (int e = 0; e < Model::kNonlinear; ++e)
        filter_.Clamp(Model::kColumns + e, image_->eta_low[e], image_->eta_high[e]);
    filter_.BeginEnd(updating_);
  }

  void FinishSample() {
    statistics_.EndSample(item_.sample.tick);
    estimates_.tick = item_.sample.tick;
    if (observer_ != nullptr) observer_(observer_context_, item_.sample, tau_model_Nm_);
    if (++estimates_.samples % publish_every_ == 0u) read_out_due_ = true;
    stage_ = Stage::kIdle;
  }

  void Publish() {
    FromPriorUnits(*image_, read_out_, estimates_);
    if constexpr (Filter::kExtended) estimates_.clamps = filter_.clamp_count();
    statistics_.Publish(estimates_);
    estimates_.refused = intake_.refused();
    published_.Post(estimates_);
    stands_ = true;
    stage_ = Stage::kIdle;
  }

  Intake<Model> intake_;
  core::Mailbox<Estimates<Model>> published_;

  const Image<Model>* image_ = nullptr;  // the background's, from here on
  Filter filter_;
  typename Filter::ReadOut read_out_;
  SampleRows<Model, Filter::kExtended> rows_;
  RowStatistics<Model> statistics_;
  Estimates<Model> estimates_;
  typename Intake<Model>::Item item_ = {};
  float tau_model_Nm_[n] = {};
  int credit_ = 0, slice_ = filter::kSliceCredit;
  std::uint32_t moving_ = 0, updating_ = 0;  // joints, a bit each; without those on hold
  std::uint32_t resets_due_ = 0;             // blocks, a bit each
  std::uint32_t publish_every_ = 125;
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
  int joint_ = 0;
  Stage stage_ = Stage::kIdle;
  bool read_out_due_ = false;
  bool hold_ = false;
  bool stands_ = false;  // nothing has changed since the read-out
};

}  // namespace armcal::estimator
