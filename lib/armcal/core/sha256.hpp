// core - the digest SHA-256 and the code HMAC-SHA256, in pieces of any length.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/core/words.hpp"

namespace armcal::core {

// SHA-256 of FIPS 180-4. Begin, Add any number of times, Finish. A block of 64 bytes takes some 3000 instructions of a
// Cortex-M4F. Context: any.
class Sha256 {
 public:
  static constexpr std::size_t kBlockBytes = 64, kDigestBytes = 32;

  void Begin() {
    constexpr std::uint32_t kStart[8] = {0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A,
                                         0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19};
    for (int k = 0; k < 8; ++k) state_[k] = kStart[k];
    bytes_ = 0, carry_ = 0;
  }
  // bytes [count], count: below 2^32
  void Add(const std::uint8_t* bytes, std::size_t count) {
    const std::uint32_t before = bytes_;
    for (std::size_t k = 0; k < count; ++k) {
      block_[bytes_++ % kBlockBytes] = bytes[k];
      if (bytes_ % kBlockBytes == 0) Compress();
    }
    if (bytes_ < before) ++carry_;
  }
  // digest [kDigestBytes]. Begin before the next use.
  void Finish(std::uint8_t* digest) {
    const std::uint64_t bits = (std::uint64_t{carry_} << 32 | bytes_) * 8;
    const std::uint8_t end = 0x80, zero = 0;
    Add(&end, 1);
    while (bytes_ % kBlockBytes != kBlockBytes - 8) Add(&zero, 1);
    std::uint8_t length[8];
    PutBytes32(length, static_cast<std::uint32_t>(bits >> 32));
    PutBytes32(length + 4, static_cast<std::uint32_t>(bits));
    Add(length, sizeof length);
    for (int k = 0; k < 8; ++k) PutBytes32(digest + 4 * k, state_[k]);
  }

 private:
  static std::uint32_t Turn(std::uint32_t x, int n) { return (x >> n) | (x << (32 - n)); }

  void Compress() {
    static constexpr std::uint32_t kRound[64] = {
        0x428A2F98, 0x71374491, 0xB5C0FBCF, 0xE9B5DBA5, 0x3956C25B, 0x59F111F1, 0x923F82A4, 0xAB1C5ED5,
        0xD807AA98, 0x12835B01, 0x243185BE, 0x550C7DC3, 0x72BE5D74, 0x80DEB1FE, 0x9BDC06A7, 0xC19BF174,
        0xE49B69C1, 0xEFBE4786, 0x0FC19DC6, 0x240CA1CC, 0x2DE92C6F, 0x4A7484AA, 0x5CB0A9DC, 0x76F988DA,
        0x983E5152, 0xA831C66D, 0xB00327C8, 0xBF597FC7, 0xC6E00BF3, 0xD5A79147, 0x06CA6351, 0x14292967,
        0x27B70A85, 0x2E1B2138, 0x4D2C6DFC, 0x53380D13, 0x650A7354, 0x766A0ABB, 0x81C2C92E, 0x92722C85,
        0xA2BFE8A1, 0xA81A664B, 0xC24B8B70, 0xC76C51A3, 0xD192E819, 0xD6990624, 0xF40E3585, 0x106AA070,
        0x19A4C116, 0x1E376C08, 0x2748774C, 0x34B0BCB5, 0x391C0CB3, 0x4ED8AA4A, 0x5B9CCA4F, 0x682E6FF3,
        0x748F82EE, 0x78A5636F, 0x84C87814, 0x8CC70208, 0x90BEFFFA, 0xA4506CEB, 0xBEF9A3F7, 0xC67178F2};
    std::uint32_t w[16];  // the last sixteen words of the schedule
    for (int k = 0; k < 16; ++k) w[k] = GetBytes32(block_ + 4 * k);
    std::uint32_t a = state_[0], b = state_[1], c = state_[2], d = state_[3];
    std::uint32_t e = state_[4], f = state_[5], g = state_[6], h = state_[7];
    for (int k = 0; k < 64; ++k) {
      if (k >= 16) {
        const std::uint32_t early = w[(k + 1) % 16], late = w[(k + 14) % 16];
        w[k % 16] += (Turn(early, 7) ^ Turn(early, 18) ^ (early >> 3)) + w[(k + 9) % 16] +
                     (Turn(late, 17) ^ Turn(late, 19) ^ (late >> 10));
      }
      const std::uint32_t one =
          h + (Turn(e, 6) ^ Turn(e, 11) ^ Turn(e, 25)) + ((e & f) ^ (~e & g)) + kRound[k] + w[k % 16];
      const std::uint32_t two = (Turn(a, 2) ^ Turn(a, 13) ^ Turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      h = g, g = f, f = e, e = d + one, d = c, c = b, b = a, a = one + two;
    }
    const std::uint32_t sum[8] = {a, b, c, d, e, f, g, h};
    for (int k = 0; k < 8; ++k) state_[k] += sum[k];
  }

  std::uint32_t state_[8];
  std::uint32_t bytes_ = 0, carry_ = 0;  // how many bytes came: low and high word
  std::uint8_t block_[kBlockBytes];
};

// HMAC-SHA256 of FIPS 198-1 and RFC 2104. Begin, Add any number of times, Finish. Context: any.
class HmacSha256 {
 public:
  // key [count], count: at most Sha256::kBlockBytes. It must not change until Finish.
  void Begin(const std::uint8_t* key, std::size_t count) {
    key_ = key;
    key_bytes_ = count;
    BeginWith(0x36);
  }
  void Add(const std::uint8_t* bytes, std::size_t count) { hash_.Add(bytes, count); }
  // code [Sha256::kDigestBytes]
  void Finish(std::uint8_t* code) {
    std::uint8_t inner[Sha256::kDigestBytes];
    hash_.Finish(inner);
    BeginWith(0x5C);
    hash_.Add(inner, sizeof inner);
    hash_.Finish(code);
  }

 private:
  void BeginWith(std::uint8_t pad) {
    hash_.Begin();
    for (std::size_t k = 0; k < Sha256::kBlockBytes; ++k) {
      const auto byte = static_cast<std::uint8_t>((k < key_bytes_ ? key_[k] : 0) ^ pad);
      hash_.Add(&byte, 1);
    }
  }

  Sha256 hash_;
  const std::uint8_t* key_ = nullptr;
  std::size_t key_bytes_ = 0;
};

// Whether two codes [count] are equal. The time does not depend on where they differ, so it tells nothing about a key.
inline bool SameBytes(const std::uint8_t* a, const std::uint8_t* b, std::size_t count) {
  std::uint8_t different = 0;
  for (std::size_t k = 0; k < count; ++k) different = static_cast<std::uint8_t>(different | (a[k] ^ b[k]));
  return different == 0;
}

}  // namespace armcal::core
