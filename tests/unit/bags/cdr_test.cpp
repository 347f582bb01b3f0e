// bags tests - CDR messages made by hand: alignment, byte order, arrays, names.
#include "host_sim/data/bags/cdr.hpp"

#include <gtest/gtest.h>

#include "tests/unit/bags/mcap_bytes.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;
using test::Int;

const std::string kLittle("\0\1\0\0", 4), kBig("\0\0\0\0", 4);
std::string Zeros(std::size_t count) { return std::string(count, '\0'); }

std::string CdrText(const std::string& text) { return test::Text(text + '\0'); }

Flat Decoded(const std::string& definition, const std::string& bytes) {
  Definitions known;
  known.Add("p/A", definition);
  Flat named, plain;
  ReadCdr(known.Find("p/A"), bytes, true, named);
  ReadCdr(known.Find("p/A"), bytes, false, plain);
  EXPECT_EQ(named.value, plain.value);
  EXPECT_EQ(named.shape, plain.shape);
  EXPECT_EQ(named.name.size(), named.value.size());
  return named;
}

using Values = std::vector<double>;
using Names = std::vector<std::string>;

TEST(Cdr, EachNumber_IsAlignedToItsSize) {
  const Flat flat = Decoded("bool a\nfloat64 b\nint8 c\nint16 d\nuint8 e\nuint32 f\nchar g\nint64 h\nfloat32 i",
                            kLittle + "\1" + Zeros(7) + Int(2.5) + "\xFF" + Zeros(1) + Int<std::int16_t>(-2) + "\7" +
                                Zeros(3) + Int(4000000000u) + "\x80" + Zeros(3) + Int<std::int64_t>(-9) + Int(0.5f));
  EXPECT_EQ(flat.value, (Values{1, 2.5, -1, -2, 7, 4e9, 128, -9, 0.5}));
  EXPECT_EQ(flat.name, (Names{"/a", "/b", "/c", "/d", "/e", "/f", "/g", "/h", "/i"}));
}

TEST(Cdr, BigEndian_IsRead) {
  const Flat flat = Decoded("uint16 a\nint32[] b\nfloat64 c",
                            kBig + std::string("\1\2", 2) + Zeros(2) + std::string("\0\0\0\2", 4) +
                                std::string("\0\0\0\1\xFF\xFF\xFF\xFE", 8) + std::string("\x40\x04\0\0\0\0\0\0", 8));
  EXPECT_EQ(flat.value, (Values{258, 1, -2, 2.5}));
}

TEST(Cdr, StructsTextsAndEmptyOnes) {
  const Flat flat = Decoded(
      "string s\nB[2] b\nEmpty e\nuint8 last\n====\nMSG: p/B\nuint8 x\nwide[] y\n====\nMSG: "
      "p/wide\nuint16 z\n====\nMSG: p/Empty\n",
      kLittle + CdrText("abc") + "\4" + Zeros(3) + Int(1u) + Int<std::uint16_t>(9) + "\5" + Zeros(1) + Int(0u) +
          Zeros(1) + "\6");
  EXPECT_EQ(flat.name, (Names{"/b[0]/x", "/b[0]/y[0]/z", "/b[1]/x", "/last"}));
  EXPECT_EQ(flat.value, (Values{4, 9, 5, 6}));
}

TEST(Cdr, NamesTellElementsApart_AlsoWithinStructs) {
  const std::string definition =
      "string[] joint_names\nPoint reference\nfloat64[] other\n====\nMSG: p/Point\nfloat32[] positions";
  const Flat flat = Decoded(definition, kLittle + Int(2u) + CdrText("b") + Zeros(2) + CdrText("a") + Zeros(2) +
                                            Int(2u) + Int(1.5f) + Int(2.5f) + Int(1u) + Zeros(4) + Int(9.0));
  EXPECT_EQ(flat.name, (Names{"/b/reference/positions", "/a/reference/positions", "/other[0]"}));
  EXPECT_EQ(flat.value, (Values{1.5, 2.5, 9}));
}

TEST(Cdr, StampOfTheHeader_IsTaken) {
  const std::string definition = "std_msgs/Header header\nuint8 x";
  const Flat flat = Decoded(definition, kLittle + Int(17) + Int(5u) + CdrText("base") + "\3");
  EXPECT_EQ(flat.stamp_ns, 17000000005);
  EXPECT_EQ(flat.name, Names{"/x"});
}

TEST(Cdr, MessageThatEndsAnywhere_IsRefused) {
  Definitions known;
  known.Add("p/A", "std_msgs/Header header\nstring[] name\nfloat64[] position");
  const std::string whole = kLittle + Int(17) + Int(5u) + CdrText("base") + Zeros(3) + Int(1u) + CdrText("j") +
                            Zeros(2) + Int(1u) + Zeros(4) + Int(1.0);
  Flat flat;
  ReadCdr(known.Find("p/A"), whole, true, flat);
  EXPECT_EQ(flat.name, Names{"/j/position"});
  for (std::size_t length = 0; length < whole.size(); ++length)
    ASSERT_EQ(ErrorOf([&] { ReadCdr(known.Find("p/A"), whole.substr(0, length), false, flat); }), "ends too early")
        << length;
}

}  // namespace
}  // namespace armcal::bags
