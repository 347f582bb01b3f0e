// table - the frame around a stored table; knows neither what the words mean nor where the bytes lie.
//
// Bytes, high byte first:
//    0 magic u32 "ARMT"      4 format u16      6 reserved u16, 0      8 schema u32     12 payload length in words u32
//   16 sequence u32         20 payload, 2 bytes a word               then CRC-32 over all bytes before it
// then, at the next multiple of the program unit, in a unit of its own: the commit word. Bytes between keep the erased
// value. The frame is the same in every format version, so that an image can check and keep a record it cannot read.
#pragma once

#include <cstdint>

#include "armcal/core/words.hpp"

namespace armcal::table {

inline constexpr std::uint32_t kRecordMagic = 0x41524D54;  // "ARMT"
inline constexpr std::uint32_t kCommitWord = 0x434D4954;   // "CMIT": many bits away from erased, be that 0x00 or 0xFF
inline constexpr std::uint16_t kFormat = 1;
inline constexpr std::uint32_t kHeaderBytes = 20;
inline constexpr std::uint32_t kCrcBytes = 4;
// The longest piece one storage operation handles, and so the largest program unit; a power of two.
inline constexpr std::uint32_t kChunkBytes = 64;
inline constexpr std::uint32_t kMaxPayloadWords = 0x10000;  // keeps every size computation far from 2^32

struct Header {
  std::uint16_t format;
  std::uint32_t schema;
  std::uint32_t words;
  std::uint32_t sequence;
};

inline void PutHeader(std::uint8_t* b, const Header& h) {
  core::PutBytes32(b, kRecordMagic);
  core::PutBytes16(b + 4, h.format);
  core::PutBytes16(b + 6, 0);
  core::PutBytes32(b + 8, h.schema);
  core::PutBytes32(b + 12, h.words);
  core::PutBytes32(b + 16, h.sequence);
}

inline Header GetHeader(const std::uint8_t* b) {
  return {core::GetBytes16(b + 4), core::GetBytes32(b + 8), core::GetBytes32(b + 12), core::GetBytes32(b + 16)};
}

constexpr std::uint32_t BodyBytes(std::uint32_t words) { return kHeaderBytes + 2 * words + kCrcBytes; }

constexpr std::uint32_t RoundUp(std::uint32_t bytes, std::uint32_t unit) { return (bytes + unit - 1) / unit * unit; }

constexpr std::uint32_t CommitOffset(std::uint32_t words, std::uint32_t unit) {
  return RoundUp(BodyBytes(words), unit);
}

// The whole record, commit word included.
constexpr std::uint32_t RecordBytes(std::uint32_t words, std::uint32_t unit) {
  return CommitOffset(words, unit) + RoundUp(4, unit);
}

}  // namespace armcal::table
