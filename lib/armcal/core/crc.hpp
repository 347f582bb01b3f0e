// core - the two checksums that the wire and the storage use.
#pragma once

#include <cstddef>
#include <cstdint>

namespace armcal::core {

namespace crc {
// Look-up tables of sixteen entries, for half a byte at a time: 64 + 32 bytes of flash instead of 1024 + 512.
struct Tables {
  std::uint32_t ieee[16];
  std::uint16_t modbus[16];
};

constexpr Tables MakeTables() {
  Tables t{};
  for (unsigned n = 0; n < 16; ++n) {
    std::uint32_t ieee = n;
    std::uint32_t modbus = n;
    for (int bit = 0; bit < 4; ++bit) {
      ieee = (ieee >> 1) ^ ((ieee & 1u) ? 0xEDB88320u : 0u);
      modbus = (modbus >> 1) ^ ((modbus & 1u) ? 0xA001u : 0u);
    }
    t.ieee[n] = ieee;
    t.modbus[n] = static_cast<std::uint16_t>(modbus);
  }
  return t;
}

inline constexpr Tables kTables = MakeTables();

constexpr std::uint32_t StepIeee(std::uint32_t crc, std::uint8_t byte) {
  crc ^= byte;
  crc = (crc >> 4) ^ kTables.ieee[crc & 15u];
  return (crc >> 4) ^ kTables.ieee[crc & 15u];
}
}  // namespace crc

// CRC-32 of IEEE 802.3 (reflected, 0xEDB88320, initial and final 0xFFFFFFFF); "123456789" gives 0xCBF43926. bytes
// [count]. `previous`: the result over the bytes before these, so that a long text can be given in pieces.
constexpr std::uint32_t Crc32(const std::uint8_t* bytes, std::size_t count, std::uint32_t previous = 0) {
  std::uint32_t c = ~previous;
  for (std::size_t i = 0; i < count; ++i) c = crc::StepIeee(c, bytes[i]);
  return ~c;
}

// CRC-32 over 16-bit words [count], high byte first: the checksum of a parameter table.
constexpr std::uint32_t Crc32Words(const std::uint16_t* words, std::size_t count, std::uint32_t previous = 0) {
  std::uint32_t c = ~previous;
  for (std::size_t i = 0; i < count; ++i) {
    c = crc::StepIeee(c, static_cast<std::uint8_t>(words[i] >> 8));
    c = crc::StepIeee(c, static_cast<std::uint8_t>(words[i] & 0xFFu));
  }
  return ~c;
}

// CRC-16 of Modbus RTU over bytes [count] (reflected, 0xA001, initial 0xFFFF); "123456789" gives 0x4B37. Sent low byte
// first.
constexpr std::uint16_t Crc16(const std::uint8_t* bytes, std::size_t count) {
  std::uint32_t c = 0xFFFFu;
  for (std::size_t i = 0; i < count; ++i) {
    c ^= bytes[i];
    c = (c >> 4) ^ crc::kTables.modbus[c & 15u];
    c = (c >> 4) ^ crc::kTables.modbus[c & 15u];
  }
  return static_cast<std::uint16_t>(c);
}

}  // namespace armcal::core
