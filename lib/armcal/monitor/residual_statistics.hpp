// monitor - residual statistics: sums by speed, position, load and temperature, and a history of the residuals' size.
#pragma once

#include <cstdint>
#include <limits>

#include "armcal/math/elementary.hpp"

namespace armcal::monitor {

// One row: the residual (measured minus committed model's torque), and the state of the joint. Joint side, SI.
struct ResidualRow {
  float residual_Nm;
  float speed_radps;
  float position_rad;
  float load_Nm;           // the committed model's torque of the links, without joint friction
  float temperature_degC;  // NaN: no sensor
};

// The sums over the rows of a bin. A sum divided by kCount is a mean, so a PC can fit the means with any function that
// is linear in the summed signals. kLoadSize sums |load|.
enum ResidualSum : int { kCount, kResidual, kSquare, kSpeed, kPosition, kLoad, kLoadSize, kTemperature, kResidualSums };
enum ResidualSignal : int { kBySpeed, kByPosition, kByLoad, kByTemperature, kResidualSignals };

// The residual statistics of one joint. A row is added to one bin of each signal. The bin is given by two things: the
// direction of motion, because friction changes its sign with it and other torques do not; and the quarter of the
// signal's range in which the value lies. The range is what the signal (speed: its magnitude) has covered since the
// restart. Ranges are learned, so nobody has to configure limits. When a range grows, the borders of its bins move; the
// means of a bin still tell what lies inside.
//
// There are two sets of bins. The first kReferenceRows rows go to the reference set and stay there: they show how well
// the model fitted when it was adopted. Later rows go to the recent set, which forgets: with every row one bin is
// faded, in turn. So all bins fade alike whether they are visited or not, the sums stay bounded, and every row costs
// the same: some 500 instructions on a Cortex-M4F, an eighth of the filter's.
class ResidualBins {
 public:
  static constexpr int kDirections = 2;  // 0: qd < 0, 1: qd > 0
  static constexpr int kQuarters = 4;
  static constexpr int kBins = kResidualSignals * kDirections * kQuarters;
  static constexpr int kValues = kBins * kResidualSums;    // of one set, in the order [signal][direction][quarter][sum]
  static constexpr std::uint32_t kReferenceRows = 16384;   // 131 s of motion at 125 Hz, several cycles of a program
  static constexpr float kKeep = 1.0f - kBins / 16384.0f;  // of a faded bin: the recent set holds 16384 rows or so

  // Forgets everything. Context: background.
  void Restart() {
    for (int k = 0; k < kValues; ++k) reference_[k] = recent_[k] = 0.0f;
    for (int s = 0; s < kResidualSignals; ++s) low_[s] = kLargest, high_[s] = -kLargest;
    rows_ = 0;
    faded_ = 0;
  }

  // use: whether the row counts: the joint is under control and moves in one direction. Returns true if the row was
  // added. A row with a number that is not finite, or not below 1e12 in size, is not added. If it is not added, no bit
  // changes. Without a temperature it is added to all bins but those by temperature. The cost is the same in every
  // case. Context: background.
  bool Add(const ResidualRow& row, bool use) {
    const bool good = (use & Usable(row.residual_Nm) & Usable(row.speed_radps) & Usable(row.position_rad) &
                       Usable(row.load_Nm)) != 0u;
    const bool warm = (good & Usable(row.temperature_degC)) != 0u;
    const std::uint32_t mask = math::MaskOf(good), warm_mask = math::MaskOf(warm);
    const float residual = math::Masked(row.residual_Nm, mask), speed = math::Masked(row.speed_radps, mask),
                position = math::Masked(row.position_rad, mask), load = math::Masked(row.load_Nm, mask),
                temperature = math::Masked(row.temperature_degC, warm_mask);
    const float value[kResidualSums] = {
        math::Masked(1.0f, mask), residual, residual * residual, speed, position, load, math::Abs(load), temperature};
    float warm_value[kResidualSums];
    for (int k = 0; k < kResidualSums; ++k) warm_value[k] = math::Masked(value[k], warm_mask);

    const bool reference = rows_ < kReferenceRows;
    float* set = (reference ? reference_ : recent_) + static_cast<int>(speed > 0.0f) * kQuarters * kResidualSums;
    AddTo(set, QuarterOf(kBySpeed, math::Abs(speed), good), kBySpeed, value);
    AddTo(set, QuarterOf(kByPosition, position, good), kByPosition, value);
    AddTo(set, QuarterOf(kByLoad, load, good), kByLoad, value);
    AddTo(set, QuarterOf(kByTemperature, temperature, warm), kByTemperature, warm_value);
    const bool fade = good & !reference;
    const float keep = math::Select(fade, kKeep, 1.0f);
    for (int k = 0; k < kResidualSums; ++k) recent_[faded_ * kResidualSums + k] *= keep;
    faded_ = (faded_ + static_cast<int>(fade)) % kBins;
    rows_ += static_cast<std::uint32_t>(good & reference);
    return good;
  }

  const float* reference() const { return reference_; }  // [kValues]
  const float* recent() const { return recent_; }        // [kValues]

 private:
  // Larger than any figure of an arm, and small enough that sums of its squares do not overflow. False for NaN.
  static constexpr float kLargest = 1e12f;
  static unsigned Usable(float x) { return math::Abs(x) < kLargest; }  // 1 or 0, to combine without a branch

  // set: the bins of one direction.
  static void AddTo(float* set, int quarter, int s, const float* value) {
    float* bin = set + (s * kDirections * kQuarters + quarter) * kResidualSums;
    for (int k = 0; k < kResidualSums; k += 4) {  // by four, because -O2 does not unroll
      const float a = bin[k] + value[k], b = bin[k + 1] + value[k + 1];
      const float c = bin[k + 2] + value[k + 2], d = bin[k + 3] + value[k + 3];
      bin[k] = a, bin[k + 1] = b, bin[k + 2] = c, bin[k + 3] = d;
    }
  }

  // Widens the range of signal s if x counts, and returns the quarter in which x lies.
  int QuarterOf(int s, float x, bool counts) {
    low_[s] = math::Min(low_[s], math::Select(counts, x, low_[s]));
    high_[s] = math::Max(high_[s], math::Select(counts, x, high_[s]));
    const float width = high_[s] - low_[s], above = kQuarters * (x - low_[s]);
    return static_cast<int>(above > width) + static_cast<int>(above > 2 * width) + static_cast<int>(above > 3 * width);
  }

  float reference_[kValues] = {}, recent_[kValues] = {};
  float low_[kResidualSignals] = {kLargest, kLargest, kLargest, kLargest};  // ranges seen
  float high_[kResidualSignals] = {-kLargest, -kLargest, -kLargest, -kLargest};
  std::uint32_t rows_ = 0;  // in the reference set
  int faded_ = 0;
};

// The size of the residuals over time. Time is divided into slices. (In the other rooms a slice is a piece of work;
// here it is a piece of time.) A slice holds, for every joint, the number of rows and the sum of squared residuals.
// When all slices are in use, two neighbours are joined: the pair with the smallest ratio of length to age. So the
// slices always reach back to the restart, and old slices are longer than new ones: a change of an hour ago is dated to
// minutes, one of last month to days. Only samples in which a joint moves count for the length of a new slice.
template <int n>
class ResidualHistory {
 public:
  static constexpr int kSlices = 32;
  static constexpr std::uint32_t kSliceSamples = 1024;  // samples with motion in a new slice: 8 s at 125 Hz

  struct Slice {
    std::uint32_t start_s = 0;            // since the restart
    float count[n] = {}, square[n] = {};  // rows; sum of residual^2
  };

  // Forgets everything. Context: background.
  void Restart() {
    slices_[0] = Slice{};
    size_ = 1;
    samples_ = 0;
  }

  // One row that ResidualBins::Add has taken. Context: background.
  void Add(int joint, float residual_Nm) {
    slices_[size_ - 1].count[joint] += 1.0f;
    slices_[size_ - 1].square[joint] += residual_Nm * residual_Nm;
  }

  // After the rows of one sample in which some joint moved; at `now_s` since the restart. Context: background.
  void EndSample(std::uint32_t now_s) {
    if (++samples_ < kSliceSamples) return;
    samples_ = 0;
    if (size_ == kSlices) Join(ShortestForItsAge(now_s));
    slices_[size_] = Slice{};
    slices_[size_++].start_s = now_s;
  }

  int size() const { return size_; }  // at least 1; the last slice is still being filled
  const Slice& slice(int i) const { return slices_[i]; }

 private:
  // Which two neighbours to join: returns the first.
  int ShortestForItsAge(std::uint32_t now_s) const {
    int best = 0;
    float least = 2.0f;  // no pair is longer than its age
    for (int i = 0; i + 1 < size_; ++i) {
      const std::uint32_t end_s = i + 2 < size_ ? slices_[i + 2].start_s : now_s;
      const float age = static_cast<float>(now_s - slices_[i].start_s) + 1.0f;
      const float share = static_cast<float>(end_s - slices_[i].start_s) / age;
      if (share < least) least = share, best = i;
    }
    return best;
  }

  void Join(int first) {
    for (int j = 0; j < n; ++j) {
      slices_[first].count[j] += slices_[first + 1].count[j];
      slices_[first].square[j] += slices_[first + 1].square[j];
    }
    for (int i = first + 1; i + 1 < size_; ++i) slices_[i] = slices_[i + 1];
    --size_;
  }

  Slice slices_[kSlices] = {};
  int size_ = 1;
  std::uint32_t samples_ = 0;
};

// The residual statistics of a whole arm: bins and history. 2.3 KB for each joint. Give it to one estimator
// (Estimator::SetResiduals), which fills it. Each adoption restarts it, because residuals of another table say nothing
// about this one. Context of every call: background.
template <int n>
class ResidualStatistics {
 public:
  static constexpr int kHistoryValues = 3 * ResidualHistory<n>::kSlices;
  // What Write gives for one joint: reference bins, recent bins, then start_s, count and square of each slice.
  static constexpr int kValues = 2 * ResidualBins::kValues + kHistoryValues;

  // tick: where slices and elapsed_s start to count.
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

  // After the rows of a sample. Between two calls the tick may wrap once.
  void EndSample(std::uint32_t tick, std::uint32_t tick_rate_Hz) {
    const std::uint32_t passed = tick - tick_;
    if (passed < 0x80000000u) {  // otherwise the sample began before the restart
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

  // values [kValues]. An unused slice starts at NaN.
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
  std::uint32_t tick_ = 0, ticks_ = 0;  // of the last sample; what is left beyond whole seconds
  std::uint32_t elapsed_s_ = 0;
  bool moved_ = false;
};

}  // namespace armcal::monitor
