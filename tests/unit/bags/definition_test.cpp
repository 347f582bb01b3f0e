// bags tests - definitions of messages: what is wrong in them is named.
#include "host_sim/data/bags/definition.hpp"

#include <gtest/gtest.h>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;

std::string ErrorFor(const std::string& text) {
  Definitions known;
  known.Add("p/msg/A", text);
  return ErrorOf([&] { known.Find("p/msg/A"); });
}

TEST(Definition, ConstantsCommentsAndDefaults_AreNoFields) {
  Definitions known;
  known.Add("p/msg/A", "# text\nint32 X=1\nint32 Y = 2\nstring Z=\"a # b\"\n\nint32 a 5  # five\n\tstring b \"x\"\r\n");
  const Definition found = known.Find("p/msg/A");
  ASSERT_EQ(found.types.size(), 1u);
  ASSERT_EQ(found.types[0].field.size(), 2u);
  EXPECT_EQ(found.types[0].field[0].name, "a");
  EXPECT_EQ(found.types[0].field[1].kind, Kind::kText);
}

TEST(Definition, BadLine_IsNamed) {
  EXPECT_EQ(ErrorFor("int32 a"), "");
  EXPECT_EQ(ErrorFor("\nint32"), "definition of p/msg/A, line 2: 'int32': expected TYPE NAME");
  EXPECT_EQ(ErrorFor("int32[ a"), "definition of p/msg/A, line 1: 'int32[ a': expected TYPE NAME");
  EXPECT_EQ(ErrorFor("int32[x] a"), "definition of p/msg/A, line 1: 'int32[x] a': expected a number in []");
  EXPECT_EQ(ErrorFor("int32[99999999999] a"),
            "definition of p/msg/A, line 1: 'int32[99999999999] a': expected a number in []");
  EXPECT_EQ(ErrorFor("wstring a"), "definition of p/msg/A, line 1: 'wstring a': armcal does not read wstring");
  EXPECT_EQ(ErrorFor("B b"), "no definition of p/B; give its file with --msg");
}

TEST(Definition, TypeThatContainsItself_IsRefused) {
  EXPECT_EQ(ErrorFor("A a"), "p/A contains itself");
  // Each type holds the next one twice: 2^14 types.
  std::string text = "T0 a\n";
  for (int k = 0; k < 14; ++k)
    text +=
        "====\nMSG: p/T" + std::to_string(k) + "\nT" + std::to_string(k + 1) + " a\nT" + std::to_string(k + 1) + " b\n";
  EXPECT_TRUE(ErrorFor(text + "====\nMSG: p/T14\nint8 a\n").ends_with("is made of too many types"));
}

}  // namespace
}  // namespace armcal::bags
