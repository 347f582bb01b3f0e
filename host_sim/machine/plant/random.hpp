// plant - draws random numbers that are the same on every platform.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace armcal::plant {

// std::mt19937_64 is fixed by the standard, its distributions are not: the mappings are ours.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  // Uniform in [lower, upper): the top 53 bits of one draw.
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(bits_() >> 11) * 0x1.0p-53;
  }

  // Standard normal (Box and Muller); two draws give two values.
  double Normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0, 1)));
    const double angle = Uniform(0, 2.0 * std::numbers::pi);
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

 private:
  std::mt19937_64 bits_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace armcal::plant
