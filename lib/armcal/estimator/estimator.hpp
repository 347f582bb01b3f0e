// estimator - where model and filter meet: samples in, estimates out; knows no register and no storage.
#pragma once

#include <type_traits>

#include "armcal/core/mailbox.hpp"
#include "armcal/core/sample_ring.hpp"
#include "armcal/estimator/axes.hpp"
#include "armcal/estimator/image.hpp"
#include "armcal/estimator/live_model.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/monitor/monitor.hpp"
#include "armcal/monitor/residual_statistics.hpp"
#include "armcal/signal/signal_path.hpp"

namespace armcal::estimator {

// What the estimator knows at one instant. Columns in filter coordinates [front, dense], own units.
template <class Model>
struct Estimates {
  std::uint32_t generation = 0;  // of the table that the filter started from
  std::uint32_t tick = 0;        // of the last sample inside
  std::uint32_t samples = 0;     // processed since adoption
  std::uint32_t stale = 0;       // samples of another generation, dropped
  std::uint32_t refused = 0;     // samples lost because the ring was full, since power-up
  float value[Model::kColumns] = {};
  float sd[Model::kColumns] = {};
  // Nonlinear parameters; the committed ones and zero unless the filter is extended.
  float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float eta_sd[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  std::uint32_t clamps = 0;  // how often an eta was cut to its bound
  std::uint32_t rows_used[Model::kJoints] = {};
  std::uint32_t rows_gated[Model::kJoints] = {};    // not valid, not moving, or outside the innovation gate
  std::uint32_t rows_refused[Model::kJoints] = {};  // not finite or beyond filter::kRowLimit
  float nis[Model::kJoints] = {};                   // see monitor::JointMonitor
  float residual_rms_Nm[Model::kJoints] = {};       // measured minus committed model, used rows
};

// Filter: filter::ForgettingFilter<Model>, filter::KalmanFilter<Model>, filter::ExtendedKalmanFilter<Model>,
// the last two in either form.
// Push and PushSample belong to the tick (use one of the two), everything else to the background.
template <class Model, class Filter>
class Estimator {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kRingSamples = 16;
  // Called once a sample after its rows: flags carry kUsed where a row changed the estimate.
  using Observer = void (*)(void* context, const model::Sample<n>& sample, const float* tau_model_Nm);

  Estimator() : path_(AxesOf<Model>()) {}

  // One control tick. kOk; kFull: a sample became ready and was refused whole because the background is late
  // (counted). Context: tick.
  core::Status Push(const model::RawSample<n>& raw) {
    TakeSettings();
    if (!path_.PushTick(raw)) return core::Status::kOk;
    return ring_.Push({path_.sample(), path_.generation()});
  }

  // A sample that a signal path made elsewhere (torque scale and flags already inside); the rest is bit for bit the
  // same. kFull as above. Context: tick, or a host's only thread.
  core::Status PushSample(const model::Sample<n>& sample) {
    TakeSettings();
    return ring_.Push({sample, path_.generation()});
  }

  // False: the filter's form cannot hold what the table asks for (see filter::Form); a table transaction refuses it.
  static bool Suits(const Image<Model>& image) { return Filter::Suits(image.prior); }

  // Restarts filter, statistics and signal path from `image`, which must suit and stay as it is until the next Adopt;
  // its generation must differ from the one before and from 0. Samples made before are dropped. adopted_tick: zero of
  // the model's time. Context: background.
  void Adopt(const Image<Model>& image, std::uint32_t adopted_tick) {
    image_ = &image;
    adopted_tick_ = adopted_tick;
    filter_.Restart(image.prior);
    estimates_ = Estimates<Model>{};
    estimates_.generation = image.committed.generation;
    for (monitor::JointMonitor& m : monitors_) m = monitor::JointMonitor{};
    if (residuals_ != nullptr) residuals_->Restart(adopted_tick);
    memory_.running = false;
    live_.Restart();
    stage_ = Stage::kIdle;
    credit_ = 0;
    slice_ = filter::EqualSlices(filter_.SampleCost() + kSampleCost + n * kRowCost);
    read_out_due_ = true;
    signal::Settings<n> settings = {};
    for (int i = 0; i < n; ++i) {
      settings.v_min_radps[i] = image.committed.v_min_radps[i];
      settings.torque_scale[i] = image.committed.torque_scale[i];
    }
    settings.generation = image.committed.generation;
    settings_.Post(settings);
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
  void SetResiduals(monitor::ResidualStatistics<n>* residuals) { residuals_ = residuals; }

  std::uint32_t refused_samples() const { return ring_.refused(); }
  std::uint32_t pending() const { return ring_.size(); }         // samples waiting for Step; context: any
  std::uint32_t tick_gaps() const { return path_.gap_count(); }  // restarts of the signal path; context: tick
  const Filter& filter() const { return filter_; }

 private:
  enum class Stage : std::uint8_t { kIdle, kRow, kUpdate, kEnd, kReadOut };
  // What a sample's regressor and a row's whitening and statistics are worth, from counts of six-axis models.
  static constexpr int kSampleCost = n * Model::kDense, kRowCost = 3 * Model::kDense;
  struct Item {
    model::Sample<n> sample;
    std::uint32_t generation;
  };

  void TakeSettings() {
    if (settings_.Refresh()) path_.SetSettings(settings_.latest());
  }

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
      case Stage::kReadOut:
        if (filter_.StepReadOut(read_out_, credit_)) Publish();
        return true;
    }
    return false;
  }

  bool StartSample() {
    if (image_ != nullptr && read_out_due_) {
      read_out_due_ = false;
      filter_.BeginReadOut(read_out_);
      stage_ = Stage::kReadOut;
      return true;
    }
    if (!core::IsOk(ring_.Pop(item_))) return false;
    credit_ -= kSampleCost;
    if (image_ == nullptr || item_.generation != image_->committed.generation) {
      ++estimates_.stale;
      return true;
    }
    const model::Sample<n>& s = item_.sample;
    model::ModelInput<float, n> state;
    moving_ = 0;
    for (int i = 0; i < n; ++i) {
      state.q[i] = s.q[i];
      state.qd[i] = s.qd[i];
      state.qdd[i] = s.qdd[i];
      state.temp[i] = s.temperature_degC[i];
      constexpr int kUpdates = model::kValid | model::kMoving;
      moving_ |= static_cast<std::uint32_t>((s.flags[i] & kUpdates) == kUpdates) << i;
    }
    state.t = static_cast<float>(s.tick - adopted_tick_) / static_cast<float>(Model::kTickRate_Hz);
    // Effects with memory run from sample to sample; after a gap they start anew and their rows wait until it is
    // forgotten.
    state.dt = static_cast<float>(Model::kSampleTicks) / static_cast<float>(Model::kTickRate_Hz);
    const bool gap = s.tick - last_tick_ != static_cast<std::uint32_t>(Model::kSampleTicks);
    memory_.running = memory_.running && !gap;
    last_tick_ = s.tick;
    feedforward::EvaluateRows(image_->committed, state, memory_, rows_);
    if constexpr (Filter::kExtended) {
      live_.Linearise(*image_, filter_, state, gap);
      credit_ -= kSampleCost;
    }
    for (int i = 0; i < n; ++i)
      if (Model::kReadyState[i] >= 0 && !(memory_.now[Model::kReadyState[i]] > 0.5f)) moving_ &= ~(1u << i);
    joint_ = 0;
    stage_ = Stage::kRow;
    return true;
  }

  const feedforward::Rows<Model>& FilterRows() const {
    if constexpr (Filter::kExtended) return live_.rows();
    else return rows_;
  }

  // Whitens the row of joint_ into prior units and hands it to the filter.
  void BeginRow() {
    const int i = joint_, first = Model::kFrontBegin[i];
    const float whiten = 1.0f / image_->sigma_Nm[i];
    const feedforward::Rows<Model>& rows = FilterRows();
    const auto scaled = [&](float value, int column) {
      return math::Masked(value * (image_->scale[column] * whiten), image_->prior.active[column]);
    };
    float front[Model::kFront > 0 ? Model::kFront : 1], dense[Model::kDense];
    for (int k = first; k < Model::kFrontBegin[i + 1]; ++k) front[k - first] = scaled(rows.front[k], k);
    for (int k = 0; k < Model::kDense; ++k) dense[k] = scaled(rows.dense[i * Model::kDense + k], Model::kFront + k);
    load_Nm_ = feedforward::LoadTorque(image_->committed.p, rows_, i);
    tau_model_Nm_[i] = feedforward::RowTorque(image_->committed.p, rows_, i, load_Nm_);
    residual_Nm_ = item_.sample.tau[i] - tau_model_Nm_[i];
    const bool use = ((moving_ >> i) & 1u) != 0u;
    if constexpr (Filter::kExtended) {
      float eta[Model::kNonlinear];
      live_.EtaRow(*image_, i, eta);
      float y = (item_.sample.tau[i] - live_.Torque(i)) * whiten;
      for (int k = first; k < Model::kFrontBegin[i + 1]; ++k) y += front[k - first] * live_.x0(k);
      for (int k = 0; k < Model::kDense; ++k) y += dense[k] * live_.x0(Model::kFront + k);
      for (int e = 0; e < Model::kNonlinear; ++e) y += (eta[e] *= whiten) * live_.x0(Model::kColumns + e);
      filter_.BeginRow(i, front, dense, y, use, eta);
    } else {
      filter_.BeginRow(i, front, dense, residual_Nm_ * whiten, use);
    }
    credit_ -= kRowCost;
    stage_ = Stage::kUpdate;
  }

  void FinishRow() {
    const int i = joint_;
    const filter::UpdateReport& report = filter_.report();
    item_.sample.flags[i] =
        static_cast<std::uint8_t>((item_.sample.flags[i] & ~model::kUsed) | (report.accepted ? model::kUsed : 0));
    estimates_.rows_used[i] += report.accepted;
    estimates_.rows_gated[i] += report.status == core::Status::kGated;
    estimates_.rows_refused[i] += core::IsRefused(report.status);
    if (report.accepted) monitors_[i].Add(report.innovation, report.variance, residual_Nm_);
    // Rows that the filter's gate keeps out count as well: they are what a changed arm looks like.
    const model::Sample<n>& s = item_.sample;
    if (residuals_ != nullptr)
      residuals_->Add(i, {residual_Nm_, s.qd[i], s.q[i], load_Nm_, s.temperature_degC[i]}, ((moving_ >> i) & 1u) != 0u);
    stage_ = ++joint_ == n ? Stage::kEnd : Stage::kRow;
    if (stage_ == Stage::kEnd) EndRows();
  }

  void EndRows() {
    if constexpr (Filter::kExtended)
      for (int e = 0; e < Model::kNonlinear; ++e)
        filter_.Clamp(Model::kColumns + e, image_->eta_low[e], image_->eta_high[e]);
    filter_.BeginEnd(moving_);
  }

  void FinishSample() {
    if (residuals_ != nullptr)
      residuals_->EndSample(item_.sample.tick, static_cast<std::uint32_t>(Model::kTickRate_Hz));
    estimates_.tick = item_.sample.tick;
    if (observer_ != nullptr) observer_(observer_context_, item_.sample, tau_model_Nm_);
    if (++estimates_.samples % publish_every_ == 0u) read_out_due_ = true;
    stage_ = Stage::kIdle;
  }

  void Publish() {
    for (int k = 0; k < Model::kColumns; ++k) {
      estimates_.value[k] = image_->committed.p[k] + image_->scale[k] * read_out_.x[k];
      estimates_.sd[k] = image_->scale[k] * read_out_.sd[k];
    }
    for (int e = 0; e < Model::kNonlinear; ++e) estimates_.eta[e] = image_->committed.eta[e];
    if constexpr (Filter::kExtended) {
      for (int e = 0; e < Model::kNonlinear; ++e) {
        const int k = Model::kColumns + e;
        estimates_.eta[e] = EtaAt(*image_, e, read_out_.x[k]);
        estimates_.eta_sd[e] = EtaSlope(*image_, e, estimates_.eta[e]) * read_out_.sd[k];
      }
      estimates_.clamps = filter_.clamp_count();
    }
    for (int i = 0; i < n; ++i) {
      estimates_.nis[i] = monitors_[i].nis();
      estimates_.residual_rms_Nm[i] = monitors_[i].residual_rms_Nm();
    }
    estimates_.refused = ring_.refused();
    published_.Post(estimates_);
    stage_ = Stage::kIdle;
  }

  signal::SignalPath<n, Model::kSampleTicks> path_;  // the tick's
  core::Mailbox<signal::Settings<n>> settings_;
  core::SampleRing<Item, kRingSamples> ring_;
  core::Mailbox<Estimates<Model>> published_;

  const Image<Model>* image_ = nullptr;  // the background's, from here on
  Filter filter_;
  typename Filter::ReadOut read_out_;
  feedforward::Rows<Model> rows_ = {};
  feedforward::Memory<Model> memory_ = {};
  std::conditional_t<Filter::kExtended, LiveModel<Model>, NoLiveModel> live_;
  monitor::JointMonitor monitors_[n];
  Estimates<Model> estimates_;
  Item item_ = {};
  float tau_model_Nm_[n] = {};
  float residual_Nm_ = 0.0f, load_Nm_ = 0.0f;  // of joint_
  int credit_ = 0, slice_ = filter::kSliceCredit;
  std::uint32_t adopted_tick_ = 0, last_tick_ = 0;
  std::uint32_t moving_ = 0;
  std::uint32_t publish_every_ = 125;
  monitor::ResidualStatistics<n>* residuals_ = nullptr;
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
  int joint_ = 0;
  Stage stage_ = Stage::kIdle;
  bool read_out_due_ = false;
};

}  // namespace armcal::estimator
