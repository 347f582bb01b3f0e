// link - the seal of a table: OpenSSL signs, and nothing that differs in one bit or in two is taken.
#include "armcal/link/seal.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "tests/unit/link/signed_tables.hpp"

namespace {

using namespace armcal;
using core::Status;
using Words = std::vector<std::uint16_t>;

constexpr std::uint32_t kSerial = 0x00012345, kCounter = 0x10002;
const test::Key kRightKey = test::MakeKey(1);

// As long as a table of six joints.
Words Unsigned() {
  Words words(840);
  for (std::size_t k = 0; k < words.size(); ++k) words[k] = static_cast<std::uint16_t>(977 * k + 5);
  words[2] = 2;
  return words;
}
Words Good() { return test::Signed(Unsigned(), kSerial, kCounter, kRightKey); }

Status Judge(const Words& words, const link::Signing& signing, std::uint32_t counter = kCounter - 1) {
  link::SealCheck check;
  check.Begin(words.data(), static_cast<int>(words.size()), signing, counter);
  Status status = Status::kBusy;
  for (int k = 0; k < 100 && status == Status::kBusy; ++k) status = check.Step();
  return status;
}
link::Signing With(const test::Key& key) {
  link::Signing signing;
  signing.key = key.data();
  signing.serial_number = kSerial;
  return signing;
}

TEST(Seal, OfTheRightKeyDriveAndCounter_IsGood) {
  EXPECT_EQ(Judge(Good(), With(kRightKey)), Status::kOk);
  EXPECT_EQ(Judge(Good(), With(kRightKey), 0), Status::kOk);
}

TEST(Seal, OfAnotherKeyDriveOrCounter_IsRefused) {
  EXPECT_EQ(Judge(Good(), With(test::MakeKey(2))), Status::kBadSignature);
  link::Signing other = With(kRightKey);
  ++other.serial_number;
  EXPECT_EQ(Judge(Good(), other), Status::kOtherDrive);
  EXPECT_EQ(Judge(Good(), With(kRightKey), kCounter), Status::kReplayed);
  EXPECT_EQ(Judge(Good(), With(kRightKey), 0xFFFFFFFF), Status::kReplayed);
}

TEST(Seal, OfAnotherMethod_IsRefused) {
  for (const int method : {0, 2, 3, 0x101})
    EXPECT_EQ(Judge(test::Signed(Unsigned(), kSerial, kCounter, kRightKey, static_cast<std::uint16_t>(method)),
                    With(kRightKey)),
              Status::kBadSignature)
        << method;
}

TEST(Seal, ThatIsMissingOrCutOff_IsRefused) {
  EXPECT_EQ(Judge(Unsigned(), With(kRightKey)), Status::kBadSignature);
  Words first_layout = Good();
  first_layout[2] = 1;
  EXPECT_EQ(Judge(first_layout, With(kRightKey)), Status::kBadSignature);
  for (std::size_t count = 3; count < Good().size(); ++count) {
    Words part = Good();
    part.resize(count);
    ASSERT_EQ(Judge(part, With(kRightKey)), Status::kBadSignature) << count;
  }
  Words longer = Good();
  longer.push_back(0);
  EXPECT_EQ(Judge(longer, With(kRightKey)), Status::kBadSignature);
}

TEST(Seal, WithAnyBitFlipped_IsRefused) {
  Words words = Good();
  for (std::size_t k = 0; k < words.size(); ++k)
    for (int bit = 0; bit < 16; ++bit) {
      words[k] = static_cast<std::uint16_t>(words[k] ^ (1 << bit));
      ASSERT_NE(Judge(words, With(kRightKey)), Status::kOk) << "word " << k << ", bit " << bit;
      words[k] = static_cast<std::uint16_t>(words[k] ^ (1 << bit));
    }
  EXPECT_EQ(Judge(words, With(kRightKey)), Status::kOk);
}

TEST(Seal, WithTwoBitsFlipped_IsRefused) {
  std::mt19937 random(11);
  const Words good = Good();
  for (int k = 0; k < 100000; ++k) {
    Words words = good;
    const unsigned bits = static_cast<unsigned>(16 * words.size());
    const unsigned one = static_cast<unsigned>(random()) % bits,
                   two = (one + 1 + static_cast<unsigned>(random()) % (bits - 1)) % bits;
    for (const unsigned bit : {one, two})
      words[bit / 16] = static_cast<std::uint16_t>(words[bit / 16] ^ (1 << bit % 16));
    ASSERT_NE(Judge(words, With(kRightKey)), Status::kOk) << one << ", " << two;
  }
}

// A function of the board, which here compares with what OpenSSL says and is slow.
struct OwnWay {
  int calls = 0;
  std::uint8_t digest[32] = {}, signature[64] = {};

  static Status Verify(void* self, const std::uint8_t* digest, const std::uint8_t* signature) {
    auto& own = *static_cast<OwnWay*>(self);
    if (++own.calls % 3 != 0) return Status::kBusy;
    const bool same = std::memcmp(digest, own.digest, 32) == 0 && std::memcmp(signature, own.signature, 64) == 0;
    return same ? Status::kOk : Status::kCorrupt;
  }
};

TEST(Seal, InTheBoardsOwnWay_IsJudgedByItsFunction) {
  OwnWay own;
  Words words = Good();
  words[words.size() - 40 + 4] = 2;
  for (int k = 0; k < 32; ++k) words[words.size() - 32 + k] = static_cast<std::uint16_t>(0x0101 * k);
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k + 32 < words.size(); ++k) {
    bytes.push_back(static_cast<std::uint8_t>(words[k] >> 8));
    bytes.push_back(static_cast<std::uint8_t>(words[k] & 0xFF));
  }
  unsigned length = 0;
  EVP_Digest(bytes.data(), bytes.size(), own.digest, &length, EVP_sha256(), nullptr);
  for (int k = 0; k < 64; ++k) own.signature[k] = static_cast<std::uint8_t>(k / 2);
  link::Signing signing;
  signing.verify = OwnWay::Verify;
  signing.context = &own;
  signing.serial_number = kSerial;
  EXPECT_EQ(Judge(words, signing), Status::kOk);
  EXPECT_EQ(own.calls, 3);
  words[words.size() - 1] ^= 1;
  EXPECT_EQ(Judge(words, signing), Status::kBadSignature);
  words[words.size() - 1] ^= 1;
  words[100] ^= 1;
  EXPECT_EQ(Judge(words, signing), Status::kBadSignature);
  EXPECT_EQ(Judge(Good(), signing), Status::kBadSignature) << "a code where a signature must be";
}

}  // namespace
