// tests - numbers and results that are the same on every machine.
#pragma once

#include <cstdint>

#include "armcal/core/crc.hpp"
#include "armcal/math/elementary.hpp"

namespace armcal::target {

// A linear congruential generator (Numerical Recipes); its numbers become floats without rounding.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : state_(seed) {}
  std::uint32_t Bits() { return state_ = state_ * 1664525u + 1013904223u; }
  int Below(int limit) { return static_cast<int>((Bits() >> 8) % static_cast<std::uint32_t>(limit)); }
  float Between(float lower, float upper) {
    return lower + (upper - lower) * (static_cast<float>(Bits() >> 8) * (1.0f / 16777216.0f));
  }
  float Signed() { return static_cast<float>(static_cast<std::int32_t>(Bits()) >> 8) * (1.0f / 8388608.0f); }

 private:
  std::uint32_t state_;
};

// Bits of a result. Which NaN it is differs between machines and means nothing.
inline std::uint32_t ResultBits(float x) { return x != x ? 0x7FC00000u : math::BitsOf(x); }

// Checksum of many results.
class Digest {
 public:
  void Add(std::uint32_t word) {
    const std::uint8_t bytes[4] = {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8),
                                   static_cast<std::uint8_t>(word >> 16), static_cast<std::uint8_t>(word >> 24)};
    crc_ = core::Crc32(bytes, sizeof bytes, crc_);
  }
  void Add(float x) { Add(ResultBits(x)); }
  void Add(const float* x, int count) {
    for (int k = 0; k < count; ++k) Add(x[k]);
  }
  std::uint32_t value() const { return crc_; }

 private:
  std::uint32_t crc_ = 0;
};

}  // namespace armcal::target
