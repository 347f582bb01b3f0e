// estimator - the tick's half: raw samples through the signal path into a ring; knows no filter.
#pragma once

#include "armcal/core/mailbox.hpp"
#include "armcal/core/sample_ring.hpp"
#include "armcal/estimator/axes.hpp"
#include "armcal/signal/signal_path.hpp"

namespace armcal::estimator {

template <class Model>
class Intake {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint32_t kRingSamples = 16;
  struct Item {
    model::Sample<n> sample;
    std::uint32_t generation;  // of the table that the signal path knew
  };

  Intake() : path_(AxesOf<Model>()) {}

  // Context: tick.
  core::Status Push(const model::RawSample<n>& raw) {
    TakeSettings();
    if (!path_.PushTick(raw)) return core::Status::kOk;
    return ring_.Push({path_.sample(), path_.generation()});
  }
  core::Status PushSample(const model::Sample<n>& sample) {
    TakeSettings();
    return ring_.Push({sample, path_.generation()});
  }
  std::uint32_t tick_gaps() const { return path_.gap_count(); }

  // Context: background.
  void Adopt(const feedforward::Committed<Model>& committed) { settings_.Post(SettingsOf(committed)); }
  core::Status Pop(Item& item) { return ring_.Pop(item); }

  // Context: any.
  std::uint32_t refused() const { return ring_.refused(); }
  std::uint32_t pending() const { return ring_.size(); }

 private:
  void TakeSettings() {
    if (settings_.Refresh()) path_.SetSettings(settings_.latest());
  }

  signal::SignalPath<n, Model::kSampleTicks> path_;
  core::Mailbox<signal::Settings<n>> settings_;
  core::SampleRing<Item, kRingSamples> ring_;
};

}  // namespace armcal::estimator
