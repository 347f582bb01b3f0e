// signal - says how late the encoders were latched, and finds repeated and missing frames by their time stamps.
#pragma once

#include <cstdint>

#include "armcal/math/columns.hpp"
#include "armcal/model/sample.hpp"

namespace armcal::signal {

// Checks the time stamp of each tick (RawSample::latch_ns). Call Start once, then Check in each tick. A stamp fits if
// it differs by at most half a period from the one that the last stamp that fitted lets expect. The stamp of the tick
// before never fits: the frame was repeated. After kPatience stamps in turn that did not fit, the next new one is taken
// as it is: the clock was set, or the frames now come a tick later. A tick without a stamp among ticks with stamps does
// not fit. Ticks that all come without a stamp always fit, and are never late. The instructions are the same for any
// stamps. Context: tick.
class LatchCheck {
 public:
  static constexpr std::int32_t kPatience = 8;  // ticks

  void Start(float tick_rate_Hz) {
    period_ns_ = static_cast<std::int32_t>(model::TickLength_ns(tick_rate_Hz));
    to_ticks_ = 1.0f / static_cast<float>(period_ns_);
    Restart();
  }
  // Call it if the next tick does not follow the one before.
  void Restart() {
    running_ = false;
    waits_ = 0;
    late_ns_ = 0;
  }

  // Takes the stamp of the next tick. stamped = false: it has none. Returns true if the frame can be believed.
  ARMCAL_NOINLINE bool Check(bool stamped, std::uint32_t latch_ns) {  // out of line, so that it has the registers
    const std::uint32_t since = latch_ns - last_ns_, period = static_cast<std::uint32_t>(period_ns_);
    const bool follows = running_ & stamped & stamped_;
    const std::int32_t limit = kPatience * period_ns_, late = static_cast<std::int32_t>(since - period);
    const std::int32_t held = math::Min(math::Max(late, -limit), limit);
    late_ns_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(held) & math::MaskOf(follows));
    off_ns_ += static_cast<std::uint32_t>(late_ns_);
    expected_ns_ += period;
    const bool near = latch_ns - expected_ns_ + period / 2u <= period, repeated = follows & (since == 0u);
    const bool fits = (stamped == expects_) & (!stamped | near) & !repeated;
    const bool taken = !running_ | fits | ((waits_ >= kPatience) & !repeated);
    waits_ = taken ? 0 : math::Min(waits_ + 1, kPatience);
    expected_ns_ = taken ? latch_ns : expected_ns_;
    expects_ = taken ? stamped : expects_;
    last_ns_ = latch_ns;
    stamped_ = stamped;
    running_ = true;
    return taken;
  }
  // By how much more than a period this tick's frame was latched after the frame of the tick before, in 1 / `parts` of
  // a tick.
  std::int32_t late(std::int32_t parts) const {
    return static_cast<std::int32_t>(InTicks(late_ns_) * static_cast<float>(parts));
  }
  // The sum of all that frames were late since the start. It wraps, so use differences.
  std::uint32_t off_ns() const { return off_ns_; }
  float InTicks(std::int32_t time_ns) const { return static_cast<float>(time_ns) * to_ticks_; }

 private:
  std::int32_t period_ns_ = 0;
  float to_ticks_ = 0.0f;
  std::uint32_t last_ns_ = 0, expected_ns_ = 0, off_ns_ = 0;
  std::int32_t late_ns_ = 0, waits_ = 0;
  bool running_ = false;
  bool stamped_ = false;  // the tick before had a stamp
  bool expects_ = false;  // ticks have stamps
};

}  // namespace armcal::signal
