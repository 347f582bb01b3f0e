// plant - encoder, current and temperature readings of one motor axis; knows no motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace armcal::plant {

// What the drive's hardware gives at the end of a tick. Shapes: one entry a motor axis.
struct Sensors {
  std::vector<std::int32_t> counts;       // motor encoder, wraps
  std::vector<std::int16_t> current_lsb;  // torque-producing current
  std::vector<double> temperature_degC;
  std::vector<bool> saturated;  // the command or the reading stood at its limit during the tick
};

// Motor position in joint units -> counts: nearest step, wrapping like a 32-bit register.
inline std::int32_t EncoderCounts(double position_rad, double gear_ratio, double counts_per_turn,
                                  long long zero_counts) {
  const double counts = position_rad * gear_ratio * counts_per_turn / (2 * std::numbers::pi);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(std::llround(counts) + zero_counts));
}

// Current -> LSB: nearest step, held at the ends of a 16-bit converter.
inline std::int16_t CurrentLsb(double current_A, double A_per_lsb) {
  return static_cast<std::int16_t>(std::llround(std::clamp(current_A / A_per_lsb, -32767.0, 32767.0)));
}

}  // namespace armcal::plant
