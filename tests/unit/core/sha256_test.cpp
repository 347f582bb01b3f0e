// core - SHA-256 and HMAC-SHA256 against published values, and against OpenSSL on random texts.
#include "armcal/core/sha256.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <random>
#include <string>
#include <vector>

namespace {

using namespace armcal::core;
using Text = std::vector<std::uint8_t>;

Text Of(const std::string& text) { return {text.begin(), text.end()}; }

std::string InHex(const std::uint8_t* bytes) {
  std::string hex;
  for (int k = 0; k < 32; ++k) {
    hex += "0123456789abcdef"[bytes[k] >> 4];
    hex += "0123456789abcdef"[bytes[k] & 15];
  }
  return hex;
}

std::string DigestOf(const Text& text) {
  Sha256 hash;
  std::uint8_t digest[32];
  hash.Begin();
  hash.Add(text.data(), text.size());
  hash.Finish(digest);
  return InHex(digest);
}

std::string CodeOf(const Text& key, const Text& text) {
  HmacSha256 hmac;
  std::uint8_t code[32];
  hmac.Begin(key.data(), key.size());
  hmac.Add(text.data(), text.size());
  hmac.Finish(code);
  return InHex(code);
}

// FIPS 180-2, appendix B, and the empty text.
TEST(Sha256, OfThePublishedTexts_IsThePublishedDigest) {
  EXPECT_EQ(DigestOf(Of("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(DigestOf(Of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(DigestOf(Text(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(DigestOf({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

// RFC 4231, test cases 1 to 4. The longer keys of its last cases are not used here.
TEST(Hmac, OfThePublishedTexts_IsThePublishedCode) {
  EXPECT_EQ(CodeOf(Text(20, 0x0B), Of("Hi There")), "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7");
  EXPECT_EQ(CodeOf(Of("Jefe"), Of("what do ya want for nothing?")),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
  EXPECT_EQ(CodeOf(Text(20, 0xAA), Text(50, 0xDD)), "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe");
  Text key(25);
  for (std::size_t k = 0; k < key.size(); ++k) key[k] = static_cast<std::uint8_t>(k + 1);
  EXPECT_EQ(CodeOf(key, Text(50, 0xCD)), "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b");
}

// Lengths around the borders of blocks, in pieces of random lengths.
TEST(Sha256AndHmac, OfRandomTexts_AreThoseOfOpenSsl) {
  std::mt19937 random(3);
  for (int round = 0; round < 600; ++round) {
    Text text(round < 300 ? static_cast<std::size_t>(round) : random() % 3000), key(random() % 65);
    for (std::uint8_t& byte : text) byte = static_cast<std::uint8_t>(random());
    for (std::uint8_t& byte : key) byte = static_cast<std::uint8_t>(random());
    Sha256 hash;
    HmacSha256 hmac;
    hash.Begin();
    hmac.Begin(key.data(), key.size());
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t piece = std::min<std::size_t>(1 + random() % 150, text.size() - at);
      hash.Add(text.data() + at, piece);
      hmac.Add(text.data() + at, piece);
      at += piece;
    }
    std::uint8_t digest[32], code[32], expected[32];
    hash.Finish(digest);
    hmac.Finish(code);
    unsigned length = 0;
    ASSERT_EQ(EVP_Digest(text.data(), text.size(), expected, &length, EVP_sha256(), nullptr), 1);
    ASSERT_EQ(InHex(digest), InHex(expected)) << text.size();
    HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), text.data(), text.size(), expected, &length);
    ASSERT_EQ(InHex(code), InHex(expected)) << text.size() << ", key " << key.size();
  }
}

TEST(SameBytes, NoticesEveryBit) {
  std::uint8_t a[32] = {}, b[32] = {};
  EXPECT_TRUE(SameBytes(a, b, 32));
  for (int bit = 0; bit < 256; ++bit) {
    b[bit / 8] = static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_FALSE(SameBytes(a, b, 32)) << bit;
    b[bit / 8] = 0;
  }
}

}  // namespace
