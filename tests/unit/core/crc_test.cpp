// core - checksums against published values and a bit-by-bit oracle, and words in bytes.
#include "armcal/core/crc.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "armcal/core/words.hpp"

namespace {

using namespace armcal::core;

const std::uint8_t kDigits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};

// Bit by bit, as the polynomial division is written in textbooks.
std::uint32_t SlowCrc(const std::vector<std::uint8_t>& bytes, std::uint32_t polynomial, std::uint32_t crc) {
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) ? (crc >> 1) ^ polynomial : crc >> 1;
  }
  return crc;
}

TEST(Crc, OfTheNineDigits_IsThePublishedCheckValue) {
  EXPECT_EQ(Crc32(kDigits, 9), 0xCBF43926u);
  EXPECT_EQ(Crc16(kDigits, 9), 0x4B37u);
  static_assert(Crc32(nullptr, 0) == 0, "an empty text has CRC 0");
}

TEST(Crc, OfRandomBytes_EqualsTheBitwiseDivision) {
  std::mt19937 random(1);
  for (int length = 0; length < 200; ++length) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(length));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    EXPECT_EQ(Crc32(bytes.data(), bytes.size()), ~SlowCrc(bytes, 0xEDB88320u, 0xFFFFFFFFu));
    EXPECT_EQ(Crc16(bytes.data(), bytes.size()), SlowCrc(bytes, 0xA001u, 0xFFFFu));
  }
}

TEST(Crc, FedInPieces_EqualsTheWhole) {
  for (std::size_t cut = 0; cut <= 9; ++cut) EXPECT_EQ(Crc32(kDigits + cut, 9 - cut, Crc32(kDigits, cut)), 0xCBF43926u);
}

TEST(Crc, OfWords_IsThatOfTheirBytesHighFirst) {
  const std::uint16_t words[] = {0x3132, 0x3334, 0x3536, 0x3738};
  EXPECT_EQ(Crc32Words(words, 4), Crc32(kDigits, 8));
}

TEST(Words, OfAFloat_AreItsBitsHighWordFirst) {
  std::uint16_t w[2];
  PutF32(w, 123456.789f);  // 0x47F12065 by IEEE 754
  EXPECT_EQ(w[0], 0x47F1);
  EXPECT_EQ(w[1], 0x2065);
  EXPECT_EQ(GetF32(w), 123456.789f);
  std::uint8_t b[4];
  PutBytes32(b, 0x12345678u);
  EXPECT_EQ(b[0], 0x12);
  EXPECT_EQ(b[3], 0x78);
  EXPECT_EQ(GetBytes32(b), 0x12345678u);
}

}  // namespace
