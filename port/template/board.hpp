// template - a new board, as the README's example firmware asks for it. Complete each line that says "here".
#pragma once

#include "armcal/controller/controller.hpp"
#include "port/template/clock.hpp"
#include "port/template/serial.hpp"
#include "port/template/storage.hpp"

namespace board {

namespace target = armcal::port::target;

inline constexpr std::uint32_t kSilence_ms = 2;  // a pause that ends a frame; at 115200 baud 3.5 characters take 0.3 ms

inline armcal::hardware::Storage Storage() { return target::TargetStorage(); }
inline armcal::hardware::Clock Clock() { return target::TargetClock(); }
inline armcal::hardware::Serial Serial() { return target::TargetSerial(); }

// What a client may do. The defaults: a table is adopted only while all axes are disabled; five saves, then one a
// minute.
inline armcal::controller::BoardRules Rules() { return {}; }

// Answers which axes are under control, one bit for each.
template <int n>
std::uint32_t Measure(armcal::model::RawSample<n>& raw, armcal::controller::SetPoint<n>& set) {
  raw = {};
  set = {};
  raw.tick = target::CountTick();
  // Here: counts and measured current of all axes at one instant, flags, temperatures (NaN without a sensor), the time
  // stamp of the encoders' latch (latch_ns, and stamped = true) if you have it, and the set-point of your motion
  // controller.
  return 0;
}
// Here: [n] N m, to your current controllers. The current of joint i is the torque over the nominal torque constant and
// over controller.feed_forward().torque_scale(i).
inline void Command(const float*) {}
inline void OnSerial() {}    // here: target::OnReceived(byte), target::NextToSend(byte)
inline void Start(float) {}  // here: serial line on, tick interrupt at this rate in Hz
inline void Sleep() {}       // here: until the next interrupt (wfi)

}  // namespace board
