// bags tests - makes the bytes of MCAP files by hand.
#pragma once

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace armcal::bags::test {

template <class Number>
std::string Int(Number value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

inline std::string Text(const std::string& text) { return Int(static_cast<std::uint32_t>(text.size())) + text; }

inline std::string Record(int opcode, const std::string& content) {
  return std::string(1, static_cast<char>(opcode)) + Int(static_cast<std::uint64_t>(content.size())) + content;
}

inline std::string Packed(const std::string& packed, const std::string& compression, std::uint64_t size,
                          std::uint32_t checksum = 0) {
  return Record(6, std::string(16, '\0') + Int(size) + Int(checksum) + Text(compression) +
                       Int(static_cast<std::uint64_t>(packed.size())) + packed);
}

inline std::string Chunk(const std::string& records, std::uint32_t checksum) {
  return Packed(records, "", records.size(), checksum);
}

inline std::string Chunk(const std::string& records) {
  return Chunk(records, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(records.data()),
                                                         static_cast<unsigned>(records.size()))));
}

// A zstd frame by hand: these bytes as they are, then one byte many times. (RFC 8878)
inline std::string ZstdFrame(const std::string& bytes, std::size_t times = 0, char repeated = 0) {
  constexpr std::size_t kBlock = 1 << 16;
  std::string blocks, frame("\x28\xB5\x2F\xFD\xA0", 5);
  std::size_t last = 0;
  const auto add = [&](std::uint32_t type, std::size_t size, const std::string& content) {
    last = blocks.size();
    blocks += Int(static_cast<std::uint32_t>(type << 1 | size << 3)).substr(0, 3) + content;
  };
  for (std::size_t at = 0; at < bytes.size(); at += kBlock) {
    const std::string part = bytes.substr(at, kBlock);
    add(0, part.size(), part);
  }
  for (std::size_t left = times; left > 0; left -= std::min(left, kBlock))
    add(1, std::min(left, kBlock), std::string(1, repeated));
  blocks[last] = static_cast<char>(blocks[last] | 1);
  return frame + Int(static_cast<std::uint32_t>(bytes.size() + times)) + blocks;
}

inline std::string Header() { return Record(1, Text("") + Text("")); }

// A whole file of these records: magic, header, records, the end of the data, footer, magic.
inline std::string File(const std::string& records) {
  const std::string magic("\x89MCAP0\r\n", 8);
  return magic + Header() + records + Record(15, Int(std::uint32_t{0})) + Record(2, std::string(20, '\0')) + magic;
}

}  // namespace armcal::bags::test
