// signal - detects encoder and current readings that cannot be real.
#pragma once

#include <cstdint>

#include "armcal/math/columns.hpp"

namespace armcal::signal {

// Upper bounds of speed and acceleration of any axis, on the joint side (rad or m). At the start an axis is expected to
// accelerate by up to kUsualAcceleration_radps2. If it accelerates more, the check raises this bound, up to
// kLargestAcceleration_radps2.
inline constexpr float kLargestSpeed_radps = 40.0f;
inline constexpr float kLargestAcceleration_radps2 = 200.0f;
inline constexpr float kUsualAcceleration_radps2 = 10.0f;

// Checks the encoder of one axis: flipped bits, repeated or swapped frames, jumps, an encoder that stands still. Call
// Start once, then Check in each tick. A step is the change of the count from one tick to the next. A step fits if it
// differs from the last good step by at most a limit: three times the learned acceleration, plus four times the mean
// noise, plus eight counts. The learned acceleration is the largest one that the axis has kept for three ticks; it
// fades slowly. A step does not fit if it is faster than kLargestSpeed_radps, or if it is zero although the axis was
// not about to stop. If the frame of a tick was latched late, its step is as much longer, by the last good step. This
// part is taken off before a step is compared.
//   Good: the last steps fitted. The count can be believed.
//   Away: a step did not fit. The differences from the last good step are summed up. When the sum is near zero again
//     and the count moves, the state is Good. So after one flipped bit only one tick is refused. If the sum does not
//     return, the state is Settling: after 8 ticks if the sum is small, else after kPatience_s or after eight steps
//     that did not fit. Frozen is a flag of this state: the count stands still although the axis was moving. When a
//     frozen count moves again and the sum is not near zero, the state is Settling.
//   Settling: also entered if a step does not fit in the first ticks, or after four ticks at rest, because then nobody
//     can tell the wrong count from the right one. Two fitting steps in turn lead to Good; after eight steps that did
//     not fit, sixteen are needed.
// Context: tick.
class CountCheck {
 public:
  static constexpr float kPatience_s = 2.0f;
  static constexpr std::int32_t kLate = 1 << 16;

  // counts_to_rad: angle of the joint (rad or m) by one count. Call it once, before the first Check.
  void Start(float counts_to_rad, float tick_rate_Hz) {
    const float counts = math::Divide(1.0f, math::Abs(counts_to_rad) * tick_rate_Hz);
    fastest_ = Whole(kLargestSpeed_radps * counts) + kFewCounts;
    most_ = Whole(kLargestAcceleration_radps2 / tick_rate_Hz * counts * kSustained);
    least_ = Whole(kUsualAcceleration_radps2 / tick_rate_Hz * counts * kSustained);
    sustained_ = least_;
    patience_ = static_cast<std::uint32_t>(kPatience_s * tick_rate_Hz);
    Restart();
  }
  // Call it if the next tick does not follow the one before.
  void Restart() {
    age_ = 0;
    state_ = kGood;
    sign_run_ = 0;
  }

  // Takes the count of the next tick. late: by how much more than a tick it was latched after the count before, in
  // 1/kLate of a tick, within 32 ticks: -kLate if this is the same frame again, 0 if this is not known. Returns true if
  // the count can be believed. The time depends on the counts by some instructions.
  ARMCAL_NOINLINE bool Check(std::int32_t counts, std::int32_t late) {  // out of line, so that it has the registers
    const std::int32_t moved = Less(counts, last_);
    const auto part = static_cast<std::int32_t>((std::int64_t{step_} * late) >> 16);  // a garbled step may make it wrap
    const std::int32_t step = Less(moved, part), jump = Less(step, step_), bend = Less(step, before_);
    const bool same = moved == 0 && 2 * late > -kLate;
    last_ = counts;
    before_ = step;
    pace_ = 2 * static_cast<std::uint32_t>(step) + static_cast<std::uint32_t>(bend);
    if (age_ < 2) {  // no step yet to compare with
      step_ = before_ = age_ == 0 ? 0 : First(moved, late);
      pace_ = 2 * static_cast<std::uint32_t>(step_);
      bend_ = 0;
      ++age_;
      still_ = 0;
      return true;
    }
    const std::uint32_t limit = Limit();
    const bool stops = same && SizeOf(step_) > kFewCounts + kWidth * recent_ / kRecent;
    const bool fits = SizeOf(jump) <= limit && SizeOf(step) <= fastest_ && !stops;
    Learn(bend, fits, limit);
    Follow(step, jump, same, fits, limit);
    age_ = age_ == ~0u ? kYoung : age_ + 1u;
    still_ = same ? math::Min(still_ + 1u, kStill) : 0u;
    return state_ == kGood;
  }
  bool moved() const { return before_ != 0; }  // from the tick before to this one
  // Twice the counts that the axis moves in a tick, at this tick.
  std::int32_t pace() const { return static_cast<std::int32_t>(pace_); }

 private:
  // All numbers are whole, because an M4F compares these in a third of the instructions. A size is in parts of a count.
  static constexpr std::uint32_t kSustained = 16, kRecent = 256, kNoise = 16384;
  static constexpr std::uint32_t kLargest = 1u << 21, kLargestNoise = 1u << 16;  // counts; more is taken for so much
  static constexpr std::uint32_t kFewCounts = 8;       // steps of whole counts differ by up to four
  static constexpr std::uint32_t kWidth = 4;           // times a mean difference, or the largest one of late
  static constexpr int kFade = 5;                      // the largest difference of late fades by 2^-5 a tick
  static constexpr int kForget = 7;                    // what the axis has shown fades by 2^-7
  static constexpr std::uint32_t kForgetEvery = 1024;  // ticks
  static constexpr std::uint32_t kHardlyAway = 6;      // limits
  static constexpr std::uint8_t kFit = 2, kWild = 8, kFitAfterWild = 16;       // steps
  static constexpr std::uint32_t kYoung = 4, kStill = 4, kHardlyPatience = 8;  // ticks

  enum State : std::uint8_t { kGood, kAway, kSettling };

  static std::int32_t Less(std::int32_t a, std::int32_t b) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
  }
  static std::uint32_t SizeOf(std::int32_t counts) {
    const auto sign = static_cast<std::uint32_t>(counts >> 31);  // without a branch
    return (static_cast<std::uint32_t>(counts) ^ sign) - sign;
  }
  static std::uint32_t Whole(float x) { return static_cast<std::uint32_t>(math::Min(x, 268435456.0f)); }
  // The first step of all: nothing but the time says how much of it is a tick's.
  static std::int32_t First(std::int32_t moved, std::int32_t late) {
    const float share = 2 * late > -kLate ? static_cast<float>(late) / static_cast<float>(kLate + late) : 0.0f;
    return Less(moved, static_cast<std::int32_t>(static_cast<float>(moved) * share));
  }
  std::uint32_t Limit() const { return kFewCounts + 3 * sustained_ / kSustained + kWidth * (noise_ / kNoise); }

  // bend: the difference of two steps. Noise and a wrong count make it change its sign; an acceleration keeps it for
  // three ticks.
  void Learn(std::int32_t bend, bool fits, std::uint32_t limit) {
    const std::uint32_t size = math::Min(SizeOf(bend), kLargest);
    noise_ += math::Min(SizeOf(Less(bend, bend_)), math::Min(limit, kLargestNoise)) - noise_ / kNoise;
    const bool same = (bend > 0) == (bend_ > 0) && bend != 0;
    bend_ = bend;
    recent_ = math::Max(recent_ - (recent_ >> kFade), fits ? size * kRecent : 0u);
    if (age_ % kForgetEvery == 0u) sustained_ = math::Max(least_, sustained_ - (sustained_ >> kForget));
    lowest_ = same && sign_run_ > 0 ? math::Min(lowest_, size) : size;
    sign_run_ = same ? static_cast<std::uint8_t>(sign_run_ + 1) : std::uint8_t{1};
    if (sign_run_ < 3) return;
    sign_run_ = 2;
    if (state_ != kGood && SizeOf(offset_) > kHardlyAway * limit) return;
    sustained_ = math::Min(most_, math::Max(sustained_, math::Min(lowest_ * kSustained, 2 * sustained_)));
    lowest_ = size;
  }

  void Follow(std::int32_t step, std::int32_t jump, bool same, bool fits, std::uint32_t limit) {
    if (state_ == kGood) {
      if (fits) {
        step_ = step;
      } else if (age_ < kYoung || still_ == kStill) {
        Settle(step, kFit);
      } else {
        state_ = kAway;
        offset_ = jump;
        since_ = 0;
        wild_ = 0;
        frozen_ = same;
      }
    } else if (state_ == kAway) {
      const std::int32_t offset = Less(offset_, Less(0, jump));
      if (!same && SizeOf(offset) <= 2 * limit) {
        state_ = kGood;
      } else if (same && !fits) {
        frozen_ = true;
      } else if (frozen_) {
        Settle(step, kFit);
      } else if (fits) {
        step_ = step;
      } else {
        offset_ = offset;
        if (++wild_ == kWild) Settle(step, kFitAfterWild);
      }
      const bool hardly = SizeOf(offset_) <= kHardlyAway * limit;
      if (++since_ > (hardly && !frozen_ ? kHardlyPatience : patience_)) Settle(step, kFit);
    } else {
      calm_ = fits ? static_cast<std::uint8_t>(calm_ + 1) : std::uint8_t{0};
      step_ = step;
      if (calm_ == needed_) state_ = kGood;
    }
  }
  void Settle(std::int32_t step, std::uint8_t fits) {
    state_ = kSettling;
    needed_ = fits;
    calm_ = 0;
    step_ = step;
  }

  std::uint32_t fastest_ = 0;                           // step, counts
  std::uint32_t most_ = 0, least_ = 0, sustained_ = 0;  // what a step differs by; kSustained parts of a count
  std::uint32_t noise_ = 0, recent_ = 0;                // kNoise and kRecent parts
  std::uint32_t lowest_ = 0;                            // of the bends of one sign in turn
  std::uint32_t patience_ = 0;                          // ticks
  std::int32_t last_ = 0;                               // count of the tick before
  std::int32_t before_ = 0;                             // its step
  std::uint32_t pace_ = 0;                              // twice the step between it and the next one
  std::int32_t bend_ = 0;                               // and its bend
  std::int32_t step_ = 0;                               // what the next step is compared with
  std::int32_t offset_ = 0;                             // how far the axis is away
  std::uint32_t since_ = 0;                             // ticks that it has been away
  std::uint32_t age_ = 0, still_ = 0;                   // ticks since the restart, and with the same count
  State state_ = kGood;
  bool frozen_ = false;
  std::uint8_t calm_ = 0, needed_ = 0, wild_ = 0, sign_run_ = 0;
};

// Checks the current of one axis. Call Check in each tick. A sensor has noise, so its readings change from tick to
// tick. If the sensor is usually noisy (more than 4 LSB) and a reading repeats for eight ticks while the axis moves,
// the sensor is stuck. If the reading changes several times within some eight ticks by far more than usual, the sensor
// is broken; a real step of the torque changes it once. Readings of +-32767 and beyond are refused, because the
// converter is at its end. Context: tick.
class CurrentCheck {
 public:
  void Restart() { stuck_ = 0, rough_ = 0, change_ = 0, running_ = false; }

  // moves: the count of the axis has moved. Returns true if the reading can be believed.
  ARMCAL_NOINLINE bool Check(std::int16_t current, bool moves) {
    const std::int32_t change = running_ ? current - last_ : 0, bend = change - change_;
    const std::uint32_t size = SizeOf(change), wide = 6u * (usual_ / (kPart / 256u)) / 256u + 8u;
    stuck_ = change == 0 && moves && running_ ? math::Min(stuck_ + 1u, kStuck) : 0u;
    const bool stuck = stuck_ == kStuck && noise_ > kNoisy * kPart;
    const bool known = count_ >= kFirst;
    rough_ += (known && size > wide ? kRoughPart : 0u) - rough_ / 8u;
    if (running_ && !stuck) {
      count_ += count_ < kMemory;
      usual_ = Mean(usual_, known ? math::Min(size, wide) : size);
      noise_ = Mean(noise_, math::Min(SizeOf(bend), 2u * wide));
    }
    last_ = current;
    change_ = change;
    running_ = true;
    return !stuck && rough_ < kRough && current < 32767 && current > -32767;
  }

 private:
  static constexpr std::uint32_t kPart = 65536, kRoughPart = 256;  // of an LSB, and of a change
  static constexpr std::uint32_t kStuck = 8;                       // ticks
  static constexpr std::uint32_t kLargest = 32767;                 // LSB
  static constexpr std::uint32_t kNoisy = 4;                       // LSB: below, a reading may well repeat itself
  static constexpr std::uint32_t kRough = 5 * kRoughPart / 2;      // changes among the last eight or so
  static constexpr std::int32_t kFirst = 64, kMemory = 16384;      // changes that the mean is made of

  static std::uint32_t SizeOf(std::int32_t x) { return static_cast<std::uint32_t>(x < 0 ? -x : x); }
  // The mean with one more size in it. A size of more than half the range is taken for that.
  std::uint32_t Mean(std::uint32_t mean, std::uint32_t size) const {
    const auto apart = static_cast<std::int32_t>(math::Min(size, kLargest) * kPart - mean);
    return mean + static_cast<std::uint32_t>(apart / count_);
  }

  std::uint32_t usual_ = 0;  // mean size of a change, kPart parts of an LSB
  std::uint32_t noise_ = 0;  // mean difference of two changes: a slow torque has none
  std::uint32_t rough_ = 0;
  std::int32_t count_ = 0;  // changes in the means
  std::uint32_t stuck_ = 0;
  std::int32_t last_ = 0, change_ = 0;
  bool running_ = false;
};

}  // namespace armcal::signal
