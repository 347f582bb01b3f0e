// link - what the framers find in whole frames, single bytes, garbled bytes and the traffic of other devices.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "armcal/core/crc.hpp"
#include "armcal/link/rtu.hpp"
#include "armcal/link/tcp.hpp"

namespace {

using namespace armcal;
using link::RtuFramer;
using link::TcpFramer;
using Bytes = std::vector<std::uint8_t>;

Bytes Tcp(const Bytes& pdu, std::uint8_t transaction) {
  Bytes frame(7 + pdu.size());
  frame[1] = transaction;
  frame[5] = static_cast<std::uint8_t>(pdu.size() + 1);
  frame[6] = 17;
  std::copy(pdu.begin(), pdu.end(), frame.begin() + 7);
  return frame;
}

// Everything that the framer finds in a stream, up to the first frame that is broken.
std::vector<Bytes> TakeTcp(TcpFramer& framer, const Bytes& stream, bool* broken = nullptr) {
  std::vector<Bytes> found;
  for (std::size_t at = 0, used = 0; at < stream.size(); at += used) {
    const auto result = framer.OnBytes(stream.data() + at, stream.size() - at, used);
    if (broken) *broken = result == TcpFramer::Result::kBroken;
    if (result == TcpFramer::Result::kBroken) break;
    if (result == TcpFramer::Result::kFrame) found.emplace_back(framer.pdu(), framer.pdu() + framer.pdu_bytes());
  }
  return found;
}

TEST(TcpFramer, Stream_CutAnywhere_YieldsTheSameFrames) {
  const Bytes a = {3, 0, 0, 0, 1}, b = {16, 0, 0x20, 0, 1, 2, 5, 6}, c(253, 7);
  Bytes stream;
  for (const Bytes& frame : {Tcp(a, 1), Tcp(b, 2), Tcp(c, 3)}) stream.insert(stream.end(), frame.begin(), frame.end());
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    TcpFramer framer;
    auto found = TakeTcp(framer, Bytes(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(cut)));
    const auto rest = TakeTcp(framer, Bytes(stream.begin() + static_cast<std::ptrdiff_t>(cut), stream.end()));
    found.insert(found.end(), rest.begin(), rest.end());
    ASSERT_EQ(found, (std::vector<Bytes>{a, b, c})) << cut;
    ASSERT_FALSE(framer.mid_frame());
  }
}

TEST(TcpFramer, Header_ThatCannotBeOne_BreaksTheStream) {
  for (const Bytes& header :
       {Bytes{0, 1, 0, 1, 0, 6, 1, 3}, Bytes{0, 1, 1, 0, 0, 6, 1, 3}, Bytes{0, 1, 0, 0, 0, 0, 1, 3},
        Bytes{0, 1, 0, 0, 0, 1, 1, 3}, Bytes{0, 1, 0, 0, 0, 255, 1, 3}, Bytes{0, 1, 0, 0, 255, 255, 1, 3}}) {
    TcpFramer framer;
    bool broken = false;
    EXPECT_TRUE(TakeTcp(framer, header, &broken).empty());
    EXPECT_TRUE(broken);
  }
}

TEST(TcpFramer, ReplyHeader_EchoesTransactionAndUnit) {
  TcpFramer framer;
  TakeTcp(framer, Tcp({3, 0, 0, 0, 1}, 0x42));
  std::uint8_t header[link::kMbapBytes];
  framer.PutReplyHeader(4, header);
  EXPECT_EQ(Bytes(header, header + 7), (Bytes{0, 0x42, 0, 0, 0, 5, 17}));
}

TEST(TcpFramer, RandomBytes_NeverOverrun) {
  std::mt19937 random(3);
  for (int run = 0; run < 20000; ++run) {
    TcpFramer framer;
    Bytes stream(random() % 400);
    for (auto& byte : stream) byte = static_cast<std::uint8_t>(random() % 3 ? 0 : random());
    for (const Bytes& pdu : TakeTcp(framer, stream)) ASSERT_LE(pdu.size(), link::kMaxPdu);
  }
}

Bytes Rtu(Bytes frame) {
  const std::uint16_t crc = core::Crc16(frame.data(), frame.size());
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

constexpr std::uint8_t kUs = 9;
constexpr std::uint32_t kSilence_ms = 2;

struct Heard {
  int requests = 0, broadcasts = 0;
  Bytes last;
};

void Feed(RtuFramer& framer, const Bytes& stream, std::uint32_t now_ms, Heard& heard) {
  std::size_t at = 0;
  do {
    std::size_t used = 0;
    const auto result = framer.OnBytes(stream.data() + at, stream.size() - at, now_ms, used);
    at += used;
    if (result == RtuFramer::Result::kNothing) continue;
    ++(result == RtuFramer::Result::kRequest ? heard.requests : heard.broadcasts);
    heard.last.assign(framer.pdu(), framer.pdu() + framer.pdu_bytes());
  } while (at < stream.size());
}

const Bytes kRead = Rtu({kUs, 3, 0, 0x20, 0, 2});
const Bytes kWrite = Rtu({kUs, 16, 0, 0x20, 0, 2, 4, 1, 2, 3, 4});

TEST(RtuFramer, Requests_BackToBackWithoutSilence_AreBothFound) {
  RtuFramer framer(kUs, kSilence_ms);
  Heard heard;
  Bytes stream = kRead;
  stream.insert(stream.end(), kWrite.begin(), kWrite.end());
  Feed(framer, stream, 0, heard);
  EXPECT_EQ(heard.requests, 2);
  EXPECT_EQ(heard.last, (Bytes{16, 0, 0x20, 0, 2, 4, 1, 2, 3, 4}));
}

TEST(RtuFramer, WriteThenRead_EndsByItsLength) {
  const Bytes pdu = {23, 0x40, 0, 0, 125, 0x01, 0x0C, 0, 2, 4, 0, 0, 0, 7};
  Bytes ours = {kUs}, others = {5};
  ours.insert(ours.end(), pdu.begin(), pdu.end()), others.insert(others.end(), pdu.begin(), pdu.end());
  RtuFramer framer(kUs, 100);
  for (const Bytes& frame :
       {Rtu(ours), Rtu(others), Rtu({5, 23, 4, 1, 2, 3, 4}), kRead}) {  // another device's reply, too
    std::size_t used = 0, at = 0;
    RtuFramer::Result result = RtuFramer::Result::kNothing;
    for (; at < frame.size(); at += used) result = framer.OnBytes(frame.data() + at, frame.size() - at, 1, used);
    const bool is_ours = frame[0] == kUs;
    EXPECT_EQ(result, is_ours ? RtuFramer::Result::kRequest : RtuFramer::Result::kNothing);
    EXPECT_TRUE(!is_ours || framer.pdu_bytes() == frame.size() - 3);
  }
}

TEST(RtuFramer, Frame_WithAnyBitFlipped_IsSilentlyDropped_AndTheNextIsHeard) {
  for (std::size_t bit = 0; bit < 8 * kWrite.size(); ++bit) {
    RtuFramer framer(kUs, kSilence_ms);
    Heard heard;
    Bytes frame = kWrite;
    frame[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    Feed(framer, frame, 100, heard);
    EXPECT_EQ(heard.requests + heard.broadcasts, 0) << bit;
    Feed(framer, kRead, 100 + kSilence_ms, heard);
    EXPECT_EQ(heard.requests, 1) << bit;
  }
}

TEST(RtuFramer, Broadcast_IsTakenButMarked) {
  RtuFramer framer(kUs, kSilence_ms);
  Heard heard;
  Feed(framer, Rtu({0, 6, 0, 0x20, 0, 1}), 0, heard);
  EXPECT_EQ(heard.broadcasts, 1);
  EXPECT_EQ(heard.requests, 0);
}

TEST(RtuFramer, OtherDevicesRequestsAndReplies_AreSkippedWithoutSilence) {
  RtuFramer framer(kUs, kSilence_ms);
  Heard heard;
  Bytes stream;
  for (const Bytes& frame : {Rtu({5, 3, 0, 0, 0, 2}), Rtu({5, 3, 4, 1, 2, 3, 4}), Rtu({5, 16, 0, 0, 0, 1, 2, 9, 9}),
                             Rtu({5, 16, 0, 0, 0, 1}), Rtu({5, 0x83, 2}), kRead})
    stream.insert(stream.end(), frame.begin(), frame.end());
  Feed(framer, stream, 0, heard);
  EXPECT_EQ(heard.requests, 1);
}

TEST(RtuFramer, NoiseAndTruncation_DeafenNoLongerThanTheSilence) {
  std::mt19937 random(5);
  for (int run = 0; run < 5000; ++run) {
    RtuFramer framer(kUs, kSilence_ms);
    Heard heard;
    Bytes noise(random() % 600);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    const Bytes part(kWrite.begin(), kWrite.begin() + static_cast<std::ptrdiff_t>(random() % kWrite.size()));
    noise.insert(noise.end(), part.begin(), part.end());
    Feed(framer, noise, 50, heard);
    heard = {};
    Feed(framer, kRead, 50 + kSilence_ms, heard);
    ASSERT_EQ(heard.requests, 1) << run;
  }
}

TEST(RtuFramer, UnknownFunction_IsDeliveredAfterSilence) {
  RtuFramer framer(kUs, kSilence_ms);
  Heard heard;
  Feed(framer, Rtu({kUs, 0x41, 1, 2, 3}), 0, heard);
  EXPECT_EQ(heard.requests, 0);
  Feed(framer, {}, kSilence_ms, heard);
  EXPECT_EQ(heard.requests, 1);
  EXPECT_EQ(heard.last, (Bytes{0x41, 1, 2, 3}));
}

TEST(RtuFramer, FrameSplitBySilence_IsNotGluedTogether) {
  RtuFramer framer(kUs, kSilence_ms);
  Heard heard;
  Feed(framer, Bytes(kRead.begin(), kRead.begin() + 4), 0, heard);
  Feed(framer, Bytes(kRead.begin() + 4, kRead.end()), kSilence_ms, heard);
  EXPECT_EQ(heard.requests, 0);
}

}  // namespace
