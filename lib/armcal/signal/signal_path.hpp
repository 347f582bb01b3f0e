// signal - from raw counts and currents to joint motion and torque of one instant.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"
#include "armcal/model/sample.hpp"
#include "armcal/signal/latch_check.hpp"
#include "armcal/signal/reading_check.hpp"

namespace armcal::signal {

// How the arm is built. Shapes: [n] motor axes, matrices [n x n] row-major. Joint side, see model::AxisInfo.
template <int n>
struct Axes {
  float counts_to_rad[n];
  std::int32_t zero_counts[n];
  float lsb_to_Nm[n];
  float motor_to_joint[n * n];         // q = A q_motor
  float motor_torque_to_joint[n * n];  // tau = B tau_motor
  float tick_rate_Hz;
};

// What the committed table says about measuring. Shapes: [n] joints.
template <int n>
struct Settings {
  float v_min_radps[n];
  float torque_scale[n];
  std::uint32_t generation;
};

// Makes one sample from every kSampleTicks ticks. Counts, currents and temperatures are averaged over the same windows
// of kSampleTicks ticks, so motion and torque have the same delay. A sample describes the CENTRE one of the last five
// windows: q, qd and qdd come from five-point fourth-order formulas over the window averages, tau and temperature from
// the centre window. Sample::tick is the FIRST tick of the centre window; all quantities belong to the instant
// (kSampleTicks - 1) / 2 ticks later. A window starts where tick % kSampleTicks == 0. Differences are taken in integers
// before any float. Limit: within five windows a count may change by less than 2^31 / kSampleTicks.
// If CountCheck refuses a count, the axis is treated as stale. If CurrentCheck refuses a current, the axis is treated
// as saturated. If LatchCheck refuses a time stamp, all axes are stale. implausible_count() counts the ticks with a
// refused count, current or time stamp.
// With time stamps, each count is brought to the instant at which an even grid has it, by the speed of its axis at that
// tick. The ticks of the grid have the nominal distance, and its middle is the mean time stamp of the centre window. So
// neither jitter nor a wrong tick rate changes speed and acceleration. Without time stamps every correction is zero.
// Context of every call: tick. The time depends on the data by a few instructions. A tick that completes a window takes
// longer.
template <int n, int kSampleTicks>
class SignalPath {
 public:
  explicit SignalPath(const Axes<n>& axes) : axes_(axes) {
    latch_.Start(axes.tick_rate_Hz);
    for (int i = 0; i < n; ++i) counts_[i].Start(axes.counts_to_rad[i], axes.tick_rate_Hz);
    for (int i = 0; i < n; ++i) settings_.torque_scale[i] = 1.0f;
    for (int i = 0; i < n * n; ++i) {
      const bool coupled = axes.motor_to_joint[i] != 0.0f || axes.motor_torque_to_joint[i] != 0.0f;
      if (!coupled) continue;
      const int joint = i / n, axis = i % n;
      if (axes_of_joint_[joint] == 0u) first_axis_[joint] = static_cast<std::uint8_t>(axis);
      axes_of_joint_[joint] |= 1u << axis;
      end_axis_[joint] = static_cast<std::uint8_t>(axis + 1);
    }
  }

  // The history restarts, so that no sample is made with two settings.
  void SetSettings(const Settings<n>& settings) {
    settings_ = settings;
    Restart();
  }

  // Takes one tick. Returns true if sample() is new. A tick that does not follow the tick before restarts the history.
  bool PushTick(const model::RawSample<n>& raw) {
    if (running_ && raw.tick != last_tick_ + 1u) {
      Restart();
      ++gap_count_;
    }
    last_tick_ = raw.tick;
    if (!running_ && raw.tick % kSampleTicks != 0u) return false;
    running_ = true;
    Accumulate(raw);
    if (++phase_ < kSampleTicks) return false;
    phase_ = 0;
    newest_ = (newest_ + 1) % kWindows;
    if (complete_ < kWindows) ++complete_;
    if (complete_ < kWindows) return false;
    MakeSample();
    return true;
  }

  const model::Sample<n>& sample() const { return sample_; }
  std::uint32_t generation() const { return settings_.generation; }
  std::uint32_t gap_count() const { return gap_count_; }                  // restarts because a tick was missing
  std::uint32_t implausible_count() const { return implausible_count_; }  // ticks with a refused reading

 private:
  static constexpr int kWindows = 5;
  static constexpr float kShare = 1.0f / kSampleTicks;

  struct Window {
    std::uint32_t tick;
    std::uint32_t first[n];  // counts of the first tick
    std::uint32_t rest[n];   // sum of (counts - first); unsigned, because a jump of an encoder may make it wrap
    std::int32_t current[n];
    float temperature[n];
    std::uint32_t off_ns;         // LatchCheck::off_ns of the first tick
    std::uint32_t late_ns;        // sum of what the other ticks differ from it; unsigned, because wrong ones may wrap
    float shift[n];               // counts by which this made the sum of the counts larger
    std::uint32_t spoilt, stale;  // axes, a bit each; spoilt: not enabled, saturated, or a current that cannot be
  };

  void Restart() {
    latch_.Restart();
    for (int i = 0; i < n; ++i) counts_[i].Restart(), currents_[i].Restart();
    running_ = false;
    phase_ = 0;
    newest_ = 0;
    complete_ = 0;
  }

  void Accumulate(const model::RawSample<n>& raw) {
    Window& w = window_[newest_];
    const bool frame_good = latch_.Check(raw.stamped, raw.latch_ns);
    if (phase_ == 0) {
      w = Window{};
      w.tick = raw.tick;
      w.off_ns = latch_.off_ns();
      for (int i = 0; i < n; ++i) w.first[i] = static_cast<std::uint32_t>(raw.counts[i]);
    }
    for (int i = 0; i < n; ++i) {
      w.rest[i] += static_cast<std::uint32_t>(raw.counts[i]) - w.first[i];
      w.current[i] += raw.current[i];
      w.temperature[i] += raw.temperature_degC[i];
    }
    const auto late_ns = static_cast<std::int32_t>(latch_.off_ns() - w.off_ns);
    const std::int32_t step_late = latch_.late(CountCheck::kLate);
    const float half_late = 0.5f * latch_.InTicks(late_ns);
    w.late_ns += static_cast<std::uint32_t>(late_ns);
    std::uint32_t spoilt = 0, stale = math::MaskOf(!frame_good), wrong = stale & 1u;
    for (int i = 0; i < n; ++i) {
      const int usable = raw.flags[i] & (model::kEnabled | model::kSaturated);
      const bool count_good = counts_[i].Check(raw.counts[i], step_late);
      const bool current_good = currents_[i].Check(raw.current[i], counts_[i].moved());
      w.shift[i] += static_cast<float>(counts_[i].pace()) * half_late;
      wrong |= static_cast<std::uint32_t>(!count_good | !current_good);
      spoilt |= static_cast<std::uint32_t>((usable != model::kEnabled) | !current_good) << i;
      stale |= static_cast<std::uint32_t>(((raw.flags[i] & model::kStale) != 0) | !count_good) << i;
    }
    w.spoilt |= spoilt;
    w.stale |= stale;
    implausible_count_ += wrong;
  }

  // kSampleTicks x (average of window a - average of window b), exact.
  static float Difference(const Window& a, const Window& b, int axis) {
    const std::uint32_t first = (a.first[axis] - b.first[axis]) * static_cast<std::uint32_t>(kSampleTicks);
    const std::uint32_t rest = a.rest[axis] - b.rest[axis];
    return static_cast<float>(static_cast<std::int32_t>(first + rest));
  }

  // What the lateness of whole windows adds to the sums below, by each difference of two windows that follow each
  // other.
  struct Lateness {
    float q[4], qd[4], qdd[4];
  };
  Lateness LatenessOf(const Window* const* w) const {
    const Window& centre = *w[2];
    float middle[kWindows], first[kWindows];  // of the window and of its first tick, in ticks of the grid
    const float grid = latch_.InTicks(static_cast<std::int32_t>(centre.late_ns)) * kShare;
    for (int k = 0; k < kWindows; ++k) {
      first[k] = latch_.InTicks(static_cast<std::int32_t>(w[k]->off_ns - centre.off_ns)) - grid;
      middle[k] = first[k] + latch_.InTicks(static_cast<std::int32_t>(w[k]->late_ns)) * kShare;
    }
    // A window's sum is too large by its speed times `first`. At an end, the speed is that of the two nearest
    // differences, continued. Each difference is divided by its own time; wrong stamps must not make this zero.
    float half[4];
    for (int k = 0; k < 4; ++k)
      half[k] = 0.5f / math::Max(kSampleTicks + middle[k + 1] - middle[k], 0.5f * kSampleTicks);
    const float e0 = first[0], e1 = first[1], e2 = first[2], e3 = first[3], e4 = first[4];
    return {{0.0f, half[1] * e2, half[2] * e2, 0.0f},
            {half[0] * (3.0f * e0 - 8.0f * e1), half[1] * (-8.0f * e1 - e0), half[2] * (8.0f * e3 + e4),
             half[3] * (8.0f * e3 - 3.0f * e4)},
            {half[0] * (16.0f * e1 - 3.0f * e0), half[1] * (16.0f * e1 + e0 - 30.0f * e2),
             half[2] * (16.0f * e3 + e4 - 30.0f * e2), half[3] * (16.0f * e3 - 3.0f * e4)}};
  }

  void MakeSample() {
    // Oldest to newest; `newest_` is the slot that the next window will take, hence the oldest.
    const Window* w[kWindows];
    for (int k = 0; k < kWindows; ++k) w[k] = &window_[(newest_ + k) % kWindows];
    const Window& centre = *w[2];
    const float step_rate_Hz = axes_.tick_rate_Hz * kShare;
    const Lateness late = LatenessOf(w);

    float q[n], qd[n], qdd[n], tau[n], step[4][n];
    for (int i = 0; i < n; ++i) {
      const float scale = axes_.counts_to_rad[i], share = scale * kShare;
      const std::uint32_t from_zero = centre.first[i] - static_cast<std::uint32_t>(axes_.zero_counts[i]);
      const float s0 = w[0]->shift[i], s1 = w[1]->shift[i], s3 = w[3]->shift[i], s4 = w[4]->shift[i];
      const float a0 = Difference(*w[1], *w[0], i), a1 = Difference(centre, *w[1], i);
      const float a2 = Difference(*w[3], centre, i), a3 = Difference(*w[4], *w[3], i);
      step[0][i] = share * a0, step[1][i] = share * a1, step[2][i] = share * a2, step[3][i] = share * a3;
      const float late_q = centre.shift[i] + (a1 * late.q[1] + a2 * late.q[2]);
      const float late_qd = 8.0f * (s3 - s1) - (s4 - s0) + Sum(a0, a1, a2, a3, late.qd);
      const float late_qdd = 16.0f * (s3 + s1) - (s4 + s0) - 30.0f * centre.shift[i] + Sum(a0, a1, a2, a3, late.qdd);
      q[i] = scale * static_cast<float>(static_cast<std::int32_t>(from_zero)) +
             share * (static_cast<float>(static_cast<std::int32_t>(centre.rest[i])) - late_q);
      const float inner = Difference(*w[3], *w[1], i), outer = Difference(*w[4], *w[0], i);
      qd[i] = (8.0f * inner - outer - late_qd) * (share / 12.0f) * step_rate_Hz;
      const float bend_inner = a2 - a1, bend_outer = Difference(*w[4], centre, i) - Difference(centre, *w[0], i);
      qdd[i] = (16.0f * bend_inner - bend_outer - late_qdd) * (share / 12.0f) * step_rate_Hz * step_rate_Hz;
      tau[i] = axes_.lsb_to_Nm[i] * kShare * static_cast<float>(centre.current[i]);
      sample_.temperature_degC[i] = centre.temperature[i] * kShare;
    }
    sample_.tick = centre.tick;
    const std::uint32_t good = GoodAxes();
    for (int i = 0; i < n; ++i) {
      const float* a = axes_.motor_to_joint + i * n;
      const auto joint = [&](const float* row, const float* axis) {
        return Dot(row, axis, first_axis_[i], end_axis_[i]);
      };
      sample_.q[i] = joint(a, q);
      sample_.qd[i] = joint(a, qd);
      sample_.qdd[i] = joint(a, qdd);
      sample_.tau[i] = settings_.torque_scale[i] * joint(axes_.motor_torque_to_joint + i * n, tau);
      bool moving = math::Abs(sample_.qd[i]) > settings_.v_min_radps[i];
      for (int k = 0; k < 4; ++k) moving &= joint(a, step[k]) * sample_.qd[i] > 0.0f;
      const bool valid = (axes_of_joint_[i] & ~good) == 0u;
      sample_.flags[i] = static_cast<std::uint8_t>((valid ? model::kValid : 0) | (moving ? model::kMoving : 0));
    }
  }

  // A bit for each axis. A stale axis spoils all axes, because every row of a model reads the motion of every joint.
  std::uint32_t GoodAxes() const {
    std::uint32_t spoilt = 0, stale = 0;
    for (const Window& w : window_) spoilt |= w.spoilt, stale |= w.stale;
    return ~spoilt & ~math::MaskOf(stale != 0u);
  }

  static float Sum(float a0, float a1, float a2, float a3, const float* weight) {
    return (a0 * weight[0] + a1 * weight[1]) + (a2 * weight[2] + a3 * weight[3]);
  }
  // Over the axes that a joint is coupled to. The others' elements are zero.
  static float Dot(const float* row, const float* x, int first, int end) {
    float sum = 0.0f;
    for (int k = first; k < end; ++k) sum += row[k] * x[k];
    return sum;
  }

  Axes<n> axes_;
  LatchCheck latch_;
  CountCheck counts_[n];
  CurrentCheck currents_[n];
  Settings<n> settings_ = {};
  std::uint32_t axes_of_joint_[n] = {};
  std::uint8_t first_axis_[n] = {}, end_axis_[n] = {};
  Window window_[kWindows] = {};
  model::Sample<n> sample_;
  std::uint32_t last_tick_ = 0;
  std::uint32_t gap_count_ = 0, implausible_count_ = 0;
  int phase_ = 0;
  int newest_ = 0;
  int complete_ = 0;
  bool running_ = false;
};

}  // namespace armcal::signal
