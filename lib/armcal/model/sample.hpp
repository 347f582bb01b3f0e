// model - one sample: as the hardware gives it, as the estimators use it, and as a model reads it.
#pragma once

#include <cstdint>

namespace armcal::model {

// Flags of one joint in a RawSample.
inline constexpr std::uint8_t kEnabled = 1;    // the axis is under control
inline constexpr std::uint8_t kSaturated = 2;  // the current stood at its limit
inline constexpr std::uint8_t kStale = 4;      // position or current is older than one tick

// One control tick, as the drive's hardware gives it. Shapes: [n] joints (motor axes).
template <int n>
struct RawSample {
  std::uint32_t tick = 0;          // control ticks since power-up, wraps
  std::int32_t counts[n] = {};     // motor encoder; may wrap, because only differences are used
  std::int16_t current[n] = {};    // measured (not commanded) torque-producing current, LSB
  std::uint8_t flags[n] = {};      // kEnabled | kSaturated | kStale
  float temperature_degC[n] = {};  // joint or motor temperature; NaN where there is no sensor
  // When the encoders latched these counts (not when the interrupt came), in ns of any clock that runs evenly. It
  // wraps at 2^32, and only differences count. It is read if `stamped` is true, which is either so in every tick or in
  // none.
  std::uint32_t latch_ns = 0;
  bool stamped = false;
};

// The distance of two ticks in RawSample::latch_ns, to the nearest nanosecond.
constexpr std::uint32_t TickLength_ns(float tick_rate_Hz) {
  return static_cast<std::uint32_t>(1e9f / tick_rate_Hz + 0.5f);
}

// Flags of one joint in a Sample.
inline constexpr std::uint8_t kValid = 1;   // enabled and not saturated in all five windows, no axis stale
inline constexpr std::uint8_t kMoving = 2;  // |qd| above v_min and of one sign in all five windows
inline constexpr std::uint8_t kUsed = 4;    // set by the estimator: this row updated the estimate

// One estimator sample. All its quantities hold for one instant: the middle of the averaging window whose first tick is
// `tick`. Joint side, SI: rad or m, N m or N. tau is the measured torque: the table's torque_scale x nominal torque
// constant (AxisInfo) x measured current.
template <int n>
struct Sample {
  std::uint32_t tick = 0;
  float q[n] = {};
  float qd[n] = {};
  float qdd[n] = {};
  float tau[n] = {};
  float temperature_degC[n] = {};
  std::uint8_t flags[n] = {};
};

// What a generated regressor reads. T: float on the target, any scalar elsewhere.
template <class T, int n>
struct ModelInput {
  T q[n];
  T qd[n];
  T qdd[n];
  T temp[n];  // deg C
  T t;        // s since the committed table was adopted
  T dt;       // s since the sample before
};

}  // namespace armcal::model
