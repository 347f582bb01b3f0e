// bags tests - MCAP files made by hand from the specification: cut, damaged, hostile, and encoded as armcal does not
// read.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/data/bags/recording.hpp"
#include "tests/unit/bags/mcap_bytes.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;
using namespace test;

// A topic "/a" of one float64 `x`, and messages 0, 1, 2 ... at 1 ms.
std::string Schema(const std::string& encoding = "ros2msg", const std::string& text = "float64 x") {
  return Record(3, Int<std::uint16_t>(1) + Text("p/msg/A") + Text(encoding) + Text(text));
}
std::string Channel(const std::string& encoding = "cdr") {
  return Record(4, Int<std::uint16_t>(7) + Int<std::uint16_t>(1) + Text("/a") + Text(encoding) + Text(""));
}
std::string MessageOf(int k, const std::string& data) {
  const auto at = static_cast<std::uint64_t>(1000000 * k);
  return Record(5, Int<std::uint16_t>(7) + Int<std::uint32_t>(1) + Int(at) + Int(at) + data);
}
std::string X(double x) { return std::string("\0\1\0\0", 4) + Int(x); }
std::string Three() { return MessageOf(0, X(0)) + MessageOf(1, X(1)) + MessageOf(2, X(2)); }

class Mcap : public testing::Test {
 protected:
  std::string ErrorFor(const std::string& bytes) {
    const auto path = folder_.Write("a.mcap", bytes);
    const std::string error = ErrorOf([&] { last_ = ReadRecording(path, {{"/a/x"}, {}, false}); });
    EXPECT_EQ(error.find('\n'), error.npos);
    return error.starts_with(path.string()) ? error.substr(path.string().size()) : error;
  }
  Eigen::Index rows() const { return last_.streams.empty() ? 0 : last_.streams[0].values.rows(); }

  TemporaryFolder folder_;
  Recording last_;
};

TEST_F(Mcap, WithoutChunks_IsRead) {
  ASSERT_EQ(ErrorFor(File(Schema() + Channel() + Three())), "");
  ASSERT_EQ(rows(), 3);
  EXPECT_EQ(last_.streams[0].values(2, 0), 2);
  EXPECT_EQ(last_.streams[0].stamp_ns[2], 2000000);
  EXPECT_EQ(last_.notes, std::vector<std::string>{
                             "/a: time is the recorder's, for most messages have no header.stamp of their own"});
}

TEST_F(Mcap, MessagesInAnyOrder_AreSortedByTime) {
  ASSERT_EQ(ErrorFor(File(Schema() + Channel() + MessageOf(2, X(2)) + MessageOf(0, X(0)) + MessageOf(1, X(1)))), "");
  EXPECT_EQ(last_.streams[0].values(0, 0), 0);
  EXPECT_EQ(last_.streams[0].values(2, 0), 2);
}

// The content of a message that begins with a header.
std::string Stamped(std::int32_t sec, double x) {
  return std::string("\0\1\0\0", 4) + Int(sec) + Int<std::uint32_t>(0) + Int<std::uint32_t>(1) + std::string(4, '\0') +
         Int(x);
}

// Ten messages; without_stamp of them have none. Two others come in the wrong order.
TEST_F(Mcap, MessagesWithoutAStamp_AreLeftOut_UnlessTheyAreMost) {
  for (const int without_stamp : {1, 6}) {
    std::string messages;
    for (int k = 0; k < 10; ++k) {
      const int turned = k == 8 ? 9 : k == 9 ? 8 : k;
      messages += MessageOf(turned, Stamped(k < without_stamp ? 0 : 100 + turned, turned));
    }
    ASSERT_EQ(ErrorFor(File(Schema("ros2msg", "std_msgs/Header header\nfloat64 x") + Channel() + messages)), "");
    const std::string notes = fmt::format("{}", fmt::join(last_.notes, "|"));
    EXPECT_NE(notes.find("/a: 1 of 10 messages have "), std::string::npos) << notes;
    EXPECT_NE(notes.find("a time before that of the message in front of them"), std::string::npos) << notes;
    if (without_stamp == 1) {
      ASSERT_EQ(rows(), 9);
      EXPECT_EQ(last_.streams[0].stamp_ns[0], 101000000000);
      EXPECT_EQ(last_.streams[0].values(8, 0), 9);
      EXPECT_NE(notes.find("1 of 10 messages have no header.stamp and are left out"), std::string::npos) << notes;
    } else {
      ASSERT_EQ(rows(), 10);
      EXPECT_EQ(last_.streams[0].stamp_ns[1], 1000000);
      EXPECT_EQ(notes.find("left out"), std::string::npos) << notes;
    }
  }
}

TEST_F(Mcap, CutAtAnyLength_IsReadUpToTheLastWholeChunk_OrRefused) {
  const std::string first = Chunk(Schema() + Channel() + Three()),
                    second = Chunk(MessageOf(3, X(3)) + MessageOf(4, X(4)));
  const std::string whole = File(first + second);
  for (std::size_t length = 8; length < whole.size(); ++length) {
    const std::string error = ErrorFor(whole.substr(0, length));
    if (length < 8 + Header().size() + first.size()) {
      ASSERT_EQ(error, ": is cut short, before its first message; copy or record it again") << length;
      continue;
    }
    ASSERT_EQ(error, "") << length;
    ASSERT_EQ(rows(), length < 8 + Header().size() + first.size() + second.size() ? 3 : 5) << length;
    ASSERT_TRUE(last_.notes.at(0).starts_with("the end of the file is missing; ")) << last_.notes[0];
  }
  EXPECT_EQ(ErrorFor(whole), "");
  EXPECT_EQ(rows(), 5);
  EXPECT_EQ(last_.notes.size(), 1u);
}

TEST_F(Mcap, DamagedFile_IsRefused) {
  const std::string records = Schema() + Channel() + Three();
  EXPECT_EQ(ErrorFor(File(Chunk(records, 12345))), ": the record at byte 25: the checksum of a chunk is wrong");
  EXPECT_EQ(ErrorFor(File(Chunk(records, 0))), "");  // 0: there is none
  EXPECT_EQ(ErrorFor(File(Chunk(records.substr(0, records.size() - 1)))), ": the record at byte 25 is damaged");
  EXPECT_EQ(ErrorFor(File(Packed(records, "lz4", records.size()))),
            ": the record at byte 25: its LZ4 data are damaged");
  EXPECT_EQ(ErrorFor(File(Packed(records, "zstd", records.size()))),
            ": the record at byte 25: its zstd data are damaged or cut short");
  EXPECT_EQ(ErrorFor(File(Packed(records, "gz\n", records.size()))),
            ": the record at byte 25: a chunk is compressed by 'gz?', expected lz4 or zstd");
  EXPECT_EQ(ErrorFor(File(Channel() + Three())), ": the record at byte 25: a channel has no schema");
  EXPECT_EQ(ErrorFor(File(Schema() + Three())).substr(0, 19), ": the record at byt");
}

TEST_F(Mcap, LengthThatCannotBe_IsRefusedWithoutTakingMemory) {
  const std::string huge = std::string(1, '\5') + Int(~std::uint64_t{0});
  EXPECT_EQ(ErrorFor(File(Schema() + Channel() + Three() + huge)).substr(0, 20), ": the record at byte");
  EXPECT_EQ(ErrorFor(File(Packed("abc", "zstd", std::uint64_t{1} << 40))),
            ": the record at byte 25: a chunk of 3 bytes claims to hold 1099511627776");
  const std::string text = Int<std::uint16_t>(1) + Int(~std::uint32_t{0});
  EXPECT_EQ(ErrorFor(File(Record(3, text))), ": the record at byte 25 is damaged");
}

TEST_F(Mcap, MessageThatIsNoneOfItsType_IsRefusedWithItsNumber) {
  EXPECT_EQ(ErrorFor(File(Schema() + Channel() + MessageOf(0, X(0)) + MessageOf(1, X(1).substr(0, 9)))),
            ": the record at byte 144: topic /a, message 2: ends too early");
  const std::string list = "float64[] x";
  const auto claims = [](std::uint32_t count) { return std::string("\0\1\0\0", 4) + Int(count); };
  EXPECT_TRUE(ErrorFor(File(Schema("ros2msg", list) + Channel() + MessageOf(0, claims(4000000000u))))
                  .ends_with("topic /a, message 1: ends too early"));
}

TEST_F(Mcap, OtherEncodings_AreRefusedByName) {
  const std::string start = ": the record at byte ";
  const auto error = [&](const std::string& schema, const std::string& channel, const std::string& data) {
    const std::string text = ErrorFor(File(Schema(schema) + Channel(channel) + MessageOf(0, data)));
    return text.starts_with(start) ? text.substr(text.find(": ", start.size()) + 2) : text;
  };
  const std::string of = "topic /a (p/msg/A): ";
  EXPECT_EQ(error("protobuf", "protobuf", ""), of + "its messages are encoded as protobuf, expected cdr or json");
  EXPECT_EQ(error("ros1msg", "ros1", ""), of + "its messages are encoded as ros1, expected cdr or json");
  EXPECT_EQ(error("ros2idl", "cdr", ""),
            of + "its definition is written in ros2idl, expected ros2msg; give its .msg file with --msg");
  const auto kind = [](char k) { return std::string("\0", 1) + k + std::string(10, '\0'); };
  EXPECT_EQ(error("ros2msg", "cdr", kind(7)),
            "topic /a, message 1: a message is encoded as XCDR2 (0x0007), expected plain CDR (XCDR1)");
  EXPECT_EQ(error("ros2msg", "cdr", kind(3)),
            "topic /a, message 1: a message is encoded as a parameter list (0x0003), expected plain CDR (XCDR1)");
}

TEST_F(Mcap, TopicThatNobodyAskedFor_MayHoldAnything) {
  const std::string other =
      Record(4, Int<std::uint16_t>(8) + Int<std::uint16_t>(0) + Text("/video") + Text("h264") + Text(""));
  const std::string frame = Record(5, Int<std::uint16_t>(8) + std::string(20, '\0') + "frame");
  EXPECT_EQ(ErrorFor(File(Schema() + Channel() + other + frame + Three())), "");
  EXPECT_EQ(rows(), 3);
}

// Six megabytes of one colour.
TEST_F(Mcap, APictureThatPacksToAlmostNothing_TakesNothingFromTheOtherTopics) {
  constexpr std::size_t kPixels = 6'000'000;
  const std::string other =
      Record(4, Int<std::uint16_t>(8) + Int<std::uint16_t>(0) + Text("/video") + Text("cdr") + Text(""));
  const std::string head = Int<std::uint16_t>(8) + std::string(20, '\0'),
                    records = other + std::string(1, '\5') + Int(std::uint64_t{head.size() + kPixels}) + head;
  const std::string chunk = Packed(ZstdFrame(records, kPixels, 'a'), "zstd", records.size() + kPixels);
  ASSERT_EQ(ErrorFor(File(Schema() + Channel() + chunk + Three())), "");
  EXPECT_EQ(rows(), 3);
}

TEST_F(Mcap, JsonMessagesOfOneTextAndOtherKeys_KeepTheirNumbersApart) {
  const auto error = ErrorFor(File(Schema("jsonschema", "{}") + Channel("json") +
                                   MessageOf(0, R"({"x": 1, "b": "text"})") + MessageOf(1, R"({"x 1b": "text"})")));
  ASSERT_EQ(error, "");
  ASSERT_EQ(rows(), 2);
  EXPECT_EQ(last_.streams[0].values(0, 0), 1);
  EXPECT_TRUE(std::isnan(last_.streams[0].values(1, 0)));
}

TEST_F(Mcap, LongArrays_AreNoColumns) {
  const auto path = folder_.Write(
      "b.mcap", File(Schema("ros2msg", "uint8[] picture\nuint8[<=4] few\nfloat64 x") + Channel() +
                     MessageOf(0, std::string("\0\1\0\0", 4) + Int<std::uint32_t>(1000) + std::string(1000, 'a') +
                                      Int<std::uint32_t>(2) + "\2\3" + std::string(6, '\0') + Int(5.0))));
  const Recording recording = ReadRecording(path, {});
  EXPECT_EQ(recording.streams.at(0).names, (std::vector<std::string>{"/a/few[0]", "/a/few[1]", "/a/x"}));
  EXPECT_EQ(recording.streams[0].values, (Eigen::RowVector3d(2, 3, 5)));
}

}  // namespace
}  // namespace armcal::bags
