// link - tables that OpenSSL has signed, for tests of drives with a key.
#pragma once

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>
#include <cstdint>
#include <vector>

namespace armcal::test {

using Key = std::array<std::uint8_t, 32>;

inline Key MakeKey(int number) {
  Key key;
  for (std::size_t k = 0; k < key.size(); ++k) key[k] = static_cast<std::uint8_t>(number + 37 * k);
  return key;
}

// What SPEC.md says of the seal: in the last 40 words serial number, counter, method, three zeros, and the code of
// all words before the last 32. reserved: stands in place of the first zero. `words`: a table of layout version 2.
inline std::vector<std::uint16_t> Signed(std::vector<std::uint16_t> words, std::uint32_t serial, std::uint32_t counter,
                                         const Key& key, std::uint16_t method = 1, std::uint16_t reserved = 0) {
  std::uint16_t* seal = words.data() + words.size() - 40;
  const std::uint16_t head[8] = {static_cast<std::uint16_t>(serial >> 16),
                                 static_cast<std::uint16_t>(serial),
                                 static_cast<std::uint16_t>(counter >> 16),
                                 static_cast<std::uint16_t>(counter),
                                 method,
                                 reserved};
  for (int k = 0; k < 40; ++k) seal[k] = k < 8 ? head[k] : std::uint16_t{0};
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k + 32 < words.size(); ++k) {
    bytes.push_back(static_cast<std::uint8_t>(words[k] >> 8));
    bytes.push_back(static_cast<std::uint8_t>(words[k] & 0xFF));
  }
  std::uint8_t code[32];
  unsigned length = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), bytes.data(), bytes.size(), code, &length);
  for (int k = 0; k < 16; ++k) seal[8 + k] = static_cast<std::uint16_t>((code[2 * k] << 8) | code[2 * k + 1]);
  return words;
}

}  // namespace armcal::test
