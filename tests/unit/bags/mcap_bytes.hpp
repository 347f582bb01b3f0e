// bags tests - makes the bytes of MCAP files by hand.
#pragma once

#include <zlib.h>

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

inline std::string Header() { return Record(1, Text("") + Text("")); }

// A whole file of these records: magic, header, records, the end of the data, footer, magic.
inline std::string File(const std::string& records) {
  const std::string magic("\x89MCAP0\r\n", 8);
  return magic + Header() + records + Record(15, Int(std::uint32_t{0})) + Record(2, std::string(20, '\0')) + magic;
}

}  // namespace armcal::bags::test
