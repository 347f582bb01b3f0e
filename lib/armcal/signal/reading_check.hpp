// signal - which readings of encoders and currents an arm can have made, and which not: a flipped bit, a repeated or
// swapped frame, an encoder that stands still while its axis moves, one that jumps, a current that is stuck.
#pragma once

#include <cstdint>

#include "armcal/math/elementary.hpp"

namespace armcal::signal {

// No axis of an arm turns faster or accelerates more, on the joint's side (rad or m). An axis is first taken for one of
// kUsualAcceleration_radps2; faster ones are learned.
inline constexpr float kLargestSpeed_radps = 40.0f;
inline constexpr float kLargestAcceleration_radps2 = 200.0f;
inline constexpr float kUsualAcceleration_radps2 = 10.0f;

// One axis. A step is what the count moves from tick to tick. Steps may differ by three times the largest acceleration
// that the axis has shown over three ticks, by the encoder's noise, and by a few counts.
//   Away: a step differs by more. What the axis has jumped by is summed up, and it is back once the sum is near zero.
//   So
//     only wrong ticks are refused, and not the one after a flipped bit, where the count is right again. An axis that
//     does not come back is taken as it is: after a few ticks if it is hardly away, and else after kPatience_s.
//   Frozen: the count stays although the axis was not about to stop.
//   Settling: after frozen, and after a jump out of standstill, where nothing tells the wrong count from the right one.
//     Two steps that fit together end it; sixteen, after an axis that jumped about.
// Context: tick.
class CountCheck {
 public:
  static constexpr float kPatience_s = 2.0f;

  void Start(float counts_to_rad, float tick_rate_Hz) {
    const float counts = math::Divide(1.0f, math::Abs(counts_to_rad) * tick_rate_Hz);
    fastest_ = kLargestSpeed_radps * counts + kFewCounts;
    most_ = kLargestAcceleration_radps2 / tick_rate_Hz * counts;
    least_ = kUsualAcceleration_radps2 / tick_rate_Hz * counts;
    sustained_ = least_;
    patience_ = static_cast<std::uint32_t>(kPatience_s * tick_rate_Hz);
    Restart();
  }
  // The next tick does not follow the one before.
  void Restart() {
    age_ = 0;
    state_ = kGood;
    sign_run_ = 0;
  }

  // True: the count can be believed. The time depends on the counts by a few instructions.
  bool Check(std::int32_t counts) {
    const std::int32_t step = Less(counts, last_), jump = Less(step, step_), bend = Less(step, before_);
    last_ = counts;
    before_ = step;
    if (age_ < 2) {  // no step yet to compare with
      step_ = before_ = age_ == 0 ? 0 : step;
      bend_ = 0;
      ++age_;
      still_ = 0;
      return true;
    }
    const float limit = Limit(), size = SizeOf(jump);
    const bool stops = step == 0 && SizeOf(step_) > kFewCounts + kWidth * recent_;
    const bool fits = size <= limit && SizeOf(step) <= fastest_ && !stops;
    Learn(bend, fits, limit);
    Follow(step, jump, fits, limit);
    age_ += age_ < kYoung;
    still_ = step == 0 ? math::Min(still_ + 1u, kStill) : 0u;
    return state_ == kGood;
  }

 private:
  static constexpr float kFewCounts = 8.0f;  // steps of whole counts differ by up to four
  static constexpr float kWidth = 4.0f;      // times a mean difference, or the largest one of late
  static constexpr float kRecent = 0.97f;    // the largest difference of late fades by this a tick
  static constexpr float kNoiseShare = 1.0f / 16384, kForget = 1.0f - 1.0f / 131072;  // a tick
  static constexpr float kHardlyAway = 6.0f;                                          // limits
  static constexpr std::uint8_t kFit = 2, kWild = 8, kFitAfterWild = 16;              // steps
  static constexpr std::uint32_t kYoung = 4, kStill = 4, kHardlyPatience = 8;         // ticks

  enum State : std::uint8_t { kGood, kAway, kSettling };

  static std::int32_t Less(std::int32_t a, std::int32_t b) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
  }
  static float SizeOf(std::int32_t counts) { return math::Abs(static_cast<float>(counts)); }
  float Limit() const { return kFewCounts + 3.0f * sustained_ + kWidth * noise_; }

  // bend: the difference of two steps. Noise and a wrong count make it change its sign; an acceleration keeps it for
  // three ticks.
  void Learn(std::int32_t bend, bool fits, float limit) {
    const float size = SizeOf(bend);
    noise_ += kNoiseShare * (math::Min(SizeOf(Less(bend, bend_)), limit) - noise_);
    const bool same = (bend > 0) == (bend_ > 0) && bend != 0;
    lowest_ = same && sign_run_ > 0 ? math::Min(lowest_, size) : size;
    sign_run_ = same ? static_cast<std::uint8_t>(math::Min(sign_run_ + 1, 3)) : std::uint8_t{1};
    bend_ = bend;
    recent_ = math::Max(kRecent * recent_, math::Select(fits, size, 0.0f));
    const bool real = sign_run_ == 3 && (state_ == kGood || SizeOf(offset_) <= kHardlyAway * limit);
    const float seen = math::Select(real, math::Min(lowest_, 2.0f * sustained_), 0.0f);
    sustained_ = math::Min(most_, math::Max(math::Max(least_, kForget * sustained_), seen));
    sign_run_ = sign_run_ == 3 ? std::uint8_t{2} : sign_run_;
    lowest_ = size < lowest_ || real ? size : lowest_;
  }

  void Follow(std::int32_t step, std::int32_t jump, bool fits, float limit) {
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
        frozen_ = step == 0;
      }
    } else if (state_ == kAway) {
      const std::int32_t offset = Less(offset_, Less(0, jump));
      if (step != 0 && SizeOf(offset) <= 2.0f * limit) {
        state_ = kGood;
      } else if (step == 0 && !fits) {
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

  float fastest_ = 0.0f, most_ = 0.0f, least_ = 0.0f;  // of a step, and of what it differs by, counts
  float noise_ = 0.0f, recent_ = 0.0f, sustained_ = 0.0f;
  float lowest_ = 0.0f;                // of the bends of one sign in turn
  std::uint32_t patience_ = 0;         // ticks
  std::int32_t last_ = 0;              // count of the tick before
  std::int32_t before_ = 0;            // its step
  std::int32_t bend_ = 0;              // and its bend
  std::int32_t step_ = 0;              // what the next step is compared with
  std::int32_t offset_ = 0;            // how far the axis is away
  std::uint32_t since_ = 0;            // ticks that it has been away
  std::uint32_t age_ = 0, still_ = 0;  // ticks since the restart, and with the same count
  State state_ = kGood;
  bool frozen_ = false;
  std::uint8_t calm_ = 0, needed_ = 0, wild_ = 0, sign_run_ = 0;
};

// The current of one axis. A sensor has noise, and its readings change from tick to tick: one that repeats itself while
// the axis moves is stuck. One that changes several times in a few ticks by far more than usual is broken, too; a
// torque that really steps does so once. A reading at the end of its 16 bits says nothing. Context: tick.
class CurrentCheck {
 public:
  void Restart() { stuck_ = 0, rough_ = 0.0f, change_ = 0, running_ = false; }

  // moves: the axis's count has moved. True: the reading can be believed.
  bool Check(std::int16_t current, bool moves) {
    const std::int32_t change = running_ ? current - last_ : 0;
    const float size = math::Abs(static_cast<float>(change)), wide = 6.0f * usual_ + 8.0f;
    stuck_ = change == 0 && moves && running_ ? math::Min(stuck_ + 1u, kStuck) : 0u;
    const bool stuck = stuck_ == kStuck && noise_ > kNoisy;
    const float bend = math::Abs(static_cast<float>(change - change_));
    const bool known = count_ >= kFirst;
    rough_ += math::Select(known && size > wide, 1.0f, 0.0f) - rough_ / 8.0f;
    count_ += running_ && !stuck && count_ < kMemory ? 1.0f : 0.0f;
    const float counted = math::Select(known, math::Min(size, wide), size);
    usual_ += math::Select(running_ && !stuck, (counted - usual_) / math::Max(count_, 1.0f), 0.0f);
    noise_ += math::Select(running_ && !stuck, (math::Min(bend, 2.0f * wide) - noise_) / math::Max(count_, 1.0f), 0.0f);
    last_ = current;
    change_ = change;
    running_ = true;
    return !stuck && rough_ < kRough && current < 32767 && current > -32767;
  }

 private:
  static constexpr std::uint32_t kStuck = 8;                  // ticks
  static constexpr float kNoisy = 4.0f;                       // LSB: below, a reading may well repeat itself
  static constexpr float kRough = 2.5f;                       // changes among the last eight or so
  static constexpr float kFirst = 64.0f, kMemory = 16384.0f;  // changes that the mean is made of

  float usual_ = 0.0f, count_ = 0.0f;  // mean size of a change, and of how many
  float noise_ = 0.0f;                 // mean difference of two changes: a slow torque has none
  float rough_ = 0.0f;
  std::uint32_t stuck_ = 0;
  std::int32_t last_ = 0, change_ = 0;
  bool running_ = false;
};

}  // namespace armcal::signal
