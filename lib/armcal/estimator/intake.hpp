// estimator - the intake: makes samples from raw samples and evaluates their regressor, once for all filters.
#pragma once

#include <atomic>

#include "armcal/core/mailbox.hpp"
#include "armcal/core/sample_ring.hpp"
#include "armcal/estimator/adopted_table.hpp"
#include "armcal/signal/signal_path.hpp"

namespace armcal::estimator {

// What the signal path must know of a generated model.
template <class Model>
signal::Axes<Model::kJoints> AxesOf() {
  constexpr int n = Model::kJoints;
  signal::Axes<n> axes = {};
  for (int i = 0; i < n; ++i) {
    axes.counts_to_rad[i] = Model::kAxes[i].counts_to_rad;
    axes.zero_counts[i] = Model::kAxes[i].zero_counts;
    axes.lsb_to_Nm[i] = Model::kAxes[i].lsb_to_Nm;
  }
  for (int i = 0; i < n * n; ++i) {
    axes.motor_to_joint[i] = Model::kMotorToJoint[i];
    axes.motor_torque_to_joint[i] = Model::kMotorTorqueToJoint[i];
  }
  axes.tick_rate_Hz = static_cast<float>(Model::kTickRate_Hz);
  return axes;
}

// What the signal path must know of a table.
template <class Model>
signal::Settings<Model::kJoints> SettingsOf(const model::Committed<Model>& committed) {
  signal::Settings<Model::kJoints> settings = {};
  for (int i = 0; i < Model::kJoints; ++i) {
    settings.v_min_radps[i] = committed.v_min_radps[i];
    settings.torque_scale[i] = committed.torque_scale[i];
  }
  settings.generation = committed.generation;
  return settings;
}

// The tick pushes ticks or samples in. In the background one or more readers (estimators) take the samples out. Each
// sample's regressor is evaluated once, when the first reader asks for it, and stays until every reader is done. A
// sample is dropped if it was made under another table than the present one (stale()).
template <class Model>
class Intake {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kRingSamples = 16;
  static constexpr int kEvaluationCost = n * Model::kDense;  // credit of one regressor, from counts of six-axis models

  Intake() : path_(AxesOf<Model>()) {}
  Intake(const Intake&) = delete;

  // One control tick. kOk; kFull: a sample became ready and the ring refused it, because the background is late
  // (counted). Context: tick.
  core::Status Push(const model::RawSample<n>& raw) {
    TakeSettings();
    const bool ready = path_.PushTick(raw);
    implausible_.store(path_.implausible_count(), std::memory_order_relaxed);
    if (!ready) return core::Status::kOk;
    return ring_.Push({path_.sample(), path_.generation()});
  }
  // One sample that a signal path made elsewhere: torque scale and flags are already inside. The rest is bit for bit
  // the same. kFull as above. Context: tick, or the only thread of a PC program.
  core::Status PushSample(const model::Sample<n>& sample) {
    TakeSettings();
    return ring_.Push({sample, path_.generation()});
  }
  std::uint32_t tick_gaps() const { return path_.gap_count(); }  // restarts of the signal path; context: tick

  // Adds a reader and returns its bit. At most 32 readers. Call it before the first sample. Context: background.
  std::uint32_t Join() {
    const std::uint32_t reader = readers_ + 1u;
    readers_ |= reader;
    return reader;
  }

  // Samples made before are dropped. `table` must not change until the next Adopt; its generation must differ from the
  // one before and from 0. adopted_tick: zero of the model's time. Context: background.
  void Adopt(const AdoptedTable<Model>& table, std::uint32_t adopted_tick) {
    committed_ = &table.committed;
    adopted_tick_ = adopted_tick;
    memory_.running = false;
    open_ = 0;
    stale_ = 0;
    settings_.Post(SettingsOf(table.committed));
  }

  // Makes the next sample for `reader` the present one, with its regressor. Returns false if there is none, or if
  // another reader is not yet done with the present one. Takes off `credit` what an evaluation costs
  // (filter/slices.hpp). Context: background.
  bool Next(std::uint32_t reader, int& credit) {
    if ((open_ & reader) != 0u) return true;
    if (open_ != 0u) return false;
    while (core::IsOk(ring_.Pop(item_))) {
      if (committed_ == nullptr || item_.generation != committed_->generation) {
        ++stale_;
        continue;
      }
      Evaluate();
      credit -= kEvaluationCost;
      open_ = readers_;
      return true;
    }
    return false;
  }
  // `reader` no longer needs the present sample. Context: background.
  void Done(std::uint32_t reader) { open_ &= ~reader; }

  // Of the present sample. Context: background.
  const model::Sample<n>& sample() const { return item_.sample; }
  const model::ModelInput<float, n>& input() const { return input_; }
  const model::Rows<Model>& rows() const { return rows_; }
  bool gap() const { return gap_; }                 // it does not follow the sample before
  std::uint32_t moving() const { return moving_; }  // joints whose rows may change an estimate, a bit each

  // Samples that were made under another table, dropped since the adoption. Context: background.
  std::uint32_t stale() const { return stale_; }
  // Context: any.
  std::uint32_t refused() const { return ring_.refused(); }
  std::uint32_t pending() const { return ring_.size(); }
  std::uint32_t implausible() const { return implausible_.load(std::memory_order_relaxed); }  // ticks: see SignalPath

 private:
  struct Item {
    model::Sample<n> sample;
    std::uint32_t generation;  // of the table that the signal path knew
  };

  void TakeSettings() {
    if (settings_.Refresh()) path_.SetSettings(settings_.latest());
  }

  // A row may change an estimate if its joint is valid and moving, and if its effects with memory no longer depend on
  // their start values. Memory runs from sample to sample and starts again after a gap.
  void Evaluate() {
    const model::Sample<n>& s = item_.sample;
    moving_ = 0;
    for (int i = 0; i < n; ++i) {
      input_.q[i] = s.q[i];
      input_.qd[i] = s.qd[i];
      input_.qdd[i] = s.qdd[i];
      input_.temp[i] = s.temperature_degC[i];
      constexpr int kUpdates = model::kValid | model::kMoving;
      moving_ |= static_cast<std::uint32_t>((s.flags[i] & kUpdates) == kUpdates) << i;
    }
    input_.t = static_cast<float>(s.tick - adopted_tick_) / static_cast<float>(Model::kTickRate_Hz);
    input_.dt = static_cast<float>(Model::kSampleTicks) / static_cast<float>(Model::kTickRate_Hz);
    gap_ = s.tick - last_tick_ != static_cast<std::uint32_t>(Model::kSampleTicks);
    memory_.running = memory_.running && !gap_;
    last_tick_ = s.tick;
    model::EvaluateRows(*committed_, input_, memory_, rows_);
    for (int i = 0; i < n; ++i)
      if (Model::kReadyState[i] >= 0 && !(memory_.now[Model::kReadyState[i]] > 0.5f)) moving_ &= ~(1u << i);
  }

  signal::SignalPath<n, Model::kSampleTicks> path_;  // the tick's
  core::Mailbox<signal::Settings<n>> settings_;
  core::SampleRing<Item, kRingSamples> ring_;
  std::atomic<std::uint32_t> implausible_{0};  // the tick writes it

  const model::Committed<Model>* committed_ = nullptr;  // the background's, from here on
  model::Memory<Model> memory_ = {};
  model::Rows<Model> rows_ = {};
  model::ModelInput<float, n> input_ = {};
  Item item_ = {};
  std::uint32_t adopted_tick_ = 0, last_tick_ = 0, moving_ = 0, stale_ = 0;
  std::uint32_t readers_ = 0, open_ = 0;  // bits of all readers, and of those that are not done with the present sample
  bool gap_ = false;
};

}  // namespace armcal::estimator
