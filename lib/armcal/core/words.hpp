// core - puts 32-bit values into 16-bit words, and words into bytes, high part first.
#pragma once

#include <cstdint>
#include <cstring>

namespace armcal::core {

// A 32-bit value in two words w [2], the high word first. A float is stored as its bits.
inline void PutU32(std::uint16_t* w, std::uint32_t v) {
  w[0] = static_cast<std::uint16_t>(v >> 16);
  w[1] = static_cast<std::uint16_t>(v & 0xFFFFu);
}

inline std::uint32_t GetU32(const std::uint16_t* w) { return (static_cast<std::uint32_t>(w[0]) << 16) | w[1]; }

inline void PutF32(std::uint16_t* w, float v) {
  std::uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  PutU32(w, bits);
}

inline float GetF32(const std::uint16_t* w) {
  const std::uint32_t bits = GetU32(w);
  float v;
  std::memcpy(&v, &bits, sizeof v);
  return v;
}

// A 16-bit value in bytes b [2], or a 32-bit value in bytes b [4], the high byte first.
inline void PutBytes16(std::uint8_t* b, std::uint16_t v) {
  b[0] = static_cast<std::uint8_t>(v >> 8);
  b[1] = static_cast<std::uint8_t>(v & 0xFFu);
}

inline void PutBytes32(std::uint8_t* b, std::uint32_t v) {
  PutBytes16(b, static_cast<std::uint16_t>(v >> 16));
  PutBytes16(b + 2, static_cast<std::uint16_t>(v & 0xFFFFu));
}

inline std::uint16_t GetBytes16(const std::uint8_t* b) { return static_cast<std::uint16_t>((b[0] << 8) | b[1]); }

inline std::uint32_t GetBytes32(const std::uint8_t* b) {
  return (static_cast<std::uint32_t>(GetBytes16(b)) << 16) | GetBytes16(b + 2);
}

}  // namespace armcal::core
