// client - the tool's signatures are those of OpenSSL, and a file with a key is read or refused without showing it.
#include "host_sim/client/table_seal.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/unit/link/signed_tables.hpp"

namespace {

using namespace armcal;
namespace fs = std::filesystem;
using Words = std::vector<std::uint16_t>;

// Two joints and three parameters.
Words FirstLayout() {
  Words words(16 + 8 * 2 + 8 * 3);
  for (std::size_t k = 0; k < words.size(); ++k) words[k] = static_cast<std::uint16_t>(311 * k + 7);
  words[2] = 1, words[3] = 2, words[4] = 3;
  return words;
}
Words SecondLayout() {
  Words words = FirstLayout();
  words[2] = 2;
  words.resize(words.size() + 2 * 2 + 40);
  return words;
}

TEST(TableSeal, OfEitherLayout_IsWhatOpenSslSigns) {
  const client::Key key = test::MakeKey(9);
  const Words expected = test::Signed(SecondLayout(), 0xABCD0123, 0x10007, key);
  EXPECT_EQ(client::SealTable(SecondLayout(), 0xABCD0123, 0x10007, key), expected);
  EXPECT_EQ(client::SealTable(FirstLayout(), 0xABCD0123, 0x10007, key), expected);
  EXPECT_EQ(client::SealTable(expected, 0xABCD0123, 0x10007, key), expected) << "an old seal does not count";
  EXPECT_EQ(client::UnsealTable(expected), SecondLayout());
  EXPECT_EQ(client::UnsealTable(FirstLayout()), FirstLayout());
  Words later = FirstLayout();
  later[2] = 3;
  EXPECT_THROW(client::SealTable(later, 1, 1, key), io::InputError);
}

TEST(TableSeal, ShowsItsCounterToItsKeyAlone) {
  const client::Key key = test::MakeKey(9);
  const Words sealed = client::SealTable(SecondLayout(), 7, 0x10007, key);
  EXPECT_EQ(client::SignedCounter(sealed, key), 0x10007u);
  EXPECT_EQ(client::SignedCounter(sealed, test::MakeKey(8)), 0u);
  EXPECT_EQ(client::SignedCounter(SecondLayout(), key), 0u);
  EXPECT_EQ(client::SignedCounter(FirstLayout(), key), 0u);
  for (std::size_t k = 0; k < sealed.size(); ++k) {
    Words changed = sealed;
    changed[k] ^= 4;
    EXPECT_EQ(client::SignedCounter(changed, key), 0u) << k;
  }
}

// Counters that a drive reaches in its life are believed; one far beyond only beside a table that was signed near it.
TEST(TableSeal, ACounterThatALineMadeUp_IsNotCredible) {
  for (const std::uint32_t proven : {0u, 5u, 900000u}) {
    EXPECT_TRUE(client::IsCredible(proven, proven));
    EXPECT_TRUE(client::IsCredible(proven + 70000, proven));
    EXPECT_FALSE(client::IsCredible(0x10000000u, proven));
    EXPECT_FALSE(client::IsCredible(0xFFFFFFFEu, proven));
  }
  EXPECT_TRUE(client::IsCredible(0x10000007u, 0x10000000u));
  EXPECT_FALSE(client::IsCredible(0x20000000u, 0x10000000u));
  EXPECT_FALSE(client::IsCredible(0x10000000u, 0x10000007u)) << "below that of the table in force";
}

std::string RefusalOfKey(const std::string& text, fs::perms perms = fs::perms::owner_read | fs::perms::owner_write) {
  const fs::path path = fs::temp_directory_path() / "armcal_test.key";
  std::ofstream(path) << text;
  fs::permissions(path, perms);
  std::string refusal;
  try {
    (void)client::ReadKey(path);
  } catch (const io::InputError& error) {
    refusal = error.what();
  }
  fs::remove(path);
  return refusal;
}

TEST(KeyFile, IsReadOrRefused_AndNeverShown) {
  const std::string digits = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1EfF";
  EXPECT_EQ(RefusalOfKey(digits), "");
  EXPECT_EQ(RefusalOfKey(digits + "\n"), "");
  const auto all = fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read;
  EXPECT_NE(RefusalOfKey(digits, all).find("chmod 600"), std::string::npos);
  for (const std::string& bad :
       {digits.substr(1), digits + "0", digits + " 0", "g" + digits.substr(1), std::string()}) {
    const std::string refusal = RefusalOfKey(bad);
    EXPECT_NE(refusal.find("64 hexadecimal digits"), std::string::npos) << refusal;
    EXPECT_EQ(refusal.find("0a0b0c"), std::string::npos) << refusal;
  }
  EXPECT_THROW((void)client::ReadKey("no_such.key"), io::InputError);
  const fs::path path = fs::temp_directory_path() / "armcal_test_good.key";
  std::ofstream(path) << digits;
  fs::permissions(path, fs::perms::owner_read);
  const client::Key key = client::ReadKey(path);
  fs::remove(path);
  EXPECT_EQ(key[1], 1);
  EXPECT_EQ(key[31], 0xFF);
}

}  // namespace
