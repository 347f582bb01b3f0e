// monitor - the residual statistics of a whole arm: bins and history per joint, and time; knows no register.
#pragma once

#include <cstdint>
#include <limits>

#include "armcal/monitor/residual_bins.hpp"
#include "armcal/monitor/residual_history.hpp"

namespace armcal::monitor {

// 2.3 KB a joint. Give it to one estimator (Estimator::SetResiduals), which fills it and restarts it with each
// adoption: what was seen with another table says nothing about this one. Context of every call: background.
template <int n>
class ResidualStatistics {
 public:
  static constexpr int kHistoryValues = 3 * ResidualHistory<n>::kSlices;
  // What Write puts out for one joint: reference bins, recent bins, then start_s, count, square of each slice.
  static constexpr int kValues = 2 * ResidualBins::kValues + kHistoryValues;

  // tick: zero of the time that slices and elapsed_s count from.
  void Restart(std::uint32_t tick) {
    for (ResidualBins& joint : bins_) joint.Restart();
    history_.Restart();
    tick_ = tick;
    ticks_ = elapsed_s_ = 0;
    moved_ = false;
  }

  // See ResidualBins::Add.
  void Add(int joint, const ResidualRow& row, bool use) {
    if (!bins_[joint].Add(row, use)) return;
    history_.Add(joint, row.residual_Nm);
    moved_ = true;
  }

  // After the rows of a sample. Ticks may wrap between two calls once.
  void EndSample(std::uint32_t tick, std::uint32_t tick_rate_Hz) {
    const std::uint32_t passed = tick - tick_;
    if (passed < 0x80000000u) {  // else the sample began before the restart
      tick_ = tick;
      ticks_ += passed;
      elapsed_s_ += ticks_ / tick_rate_Hz;
      ticks_ %= tick_rate_Hz;
    }
    if (moved_) history_.EndSample(elapsed_s_);
    moved_ = false;
  }

  std::uint32_t elapsed_s() const { return elapsed_s_; }
  const ResidualBins& bins(int joint) const { return bins_[joint]; }
  const ResidualHistory<n>& history() const { return history_; }

  // values [kValues]. A slice that is not there starts at NaN.
  void Write(int joint, float* values) const {
    for (int k = 0; k < ResidualBins::kValues; ++k) values[k] = bins_[joint].reference()[k];
    values += ResidualBins::kValues;
    for (int k = 0; k < ResidualBins::kValues; ++k) values[k] = bins_[joint].recent()[k];
    values += ResidualBins::kValues;
    for (int i = 0; i < ResidualHistory<n>::kSlices; ++i, values += 3) {
      const auto& slice = history_.slice(i);
      const bool there = i < history_.size();
      values[0] = there ? static_cast<float>(slice.start_s) : std::numeric_limits<float>::quiet_NaN();
      values[1] = there ? slice.count[joint] : 0.0f;
      values[2] = there ? slice.square[joint] : 0.0f;
    }
  }

 private:
  ResidualBins bins_[n];
  ResidualHistory<n> history_;
  std::uint32_t tick_ = 0, ticks_ = 0;  // of the last sample; beyond whole seconds
  std::uint32_t elapsed_s_ = 0;
  bool moved_ = false;
};

}  // namespace armcal::monitor
