// link - what each function code answers, and in which order it refuses; replies are checked byte by byte.
#include "armcal/link/pdu_engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using Bytes = std::vector<std::uint8_t>;
namespace reg = link::reg;

class Engine : public testing::Test {
 protected:
  Bytes Ask(const Bytes& request) {
    Bytes reply(link::kMaxPdu);
    reply.resize(drive_.device.engine().Handle(request.data(), request.size(), reply.data()));
    return reply;
  }
  core::Status LastStatus() { return drive_.device.map().last_error().status; }

  test::TestDevice drive_;
};

TEST_F(Engine, Read_OfTheProbes_IsBigEndianWordByWord) {
  EXPECT_EQ(Ask({4, 0, 0, 0, 2}), (Bytes{4, 4, 'A', 'R', 'M', 'C'}));
  EXPECT_EQ(Ask({4, 0, 12, 0, 4}), (Bytes{4, 8, 0x47, 0xF1, 0x20, 0x65, 0x12, 0x34, 0x56, 0x78}));
}

TEST_F(Engine, Scratch_WrittenBy6And16_ReadsBack) {
  EXPECT_EQ(Ask({6, 0, 0x20, 0xAB, 0xCD}), (Bytes{6, 0, 0x20, 0xAB, 0xCD}));
  EXPECT_EQ(Ask({16, 0, 0x21, 0, 2, 4, 1, 2, 3, 4}), (Bytes{16, 0, 0x21, 0, 2}));
  EXPECT_EQ(Ask({3, 0, 0x20, 0, 3}), (Bytes{3, 6, 0xAB, 0xCD, 1, 2, 3, 4}));
}

TEST_F(Engine, RequestWhoseReplyIsHeld_CountsOnce) {
  drive_.application.slices = 5;
  const auto table = test::MakeTable(1);
  const auto write = [](std::uint16_t first, const std::vector<std::uint16_t>& words) {
    Bytes request{16, static_cast<std::uint8_t>(first >> 8),   static_cast<std::uint8_t>(first),
                  0,  static_cast<std::uint8_t>(words.size()), static_cast<std::uint8_t>(2 * words.size())};
    for (const std::uint16_t w : words)
      request.push_back(static_cast<std::uint8_t>(w >> 8)), request.push_back(static_cast<std::uint8_t>(w));
    return request;
  };
  const auto command = [&](std::uint32_t sequence, std::uint32_t name) {
    link::Words<reg::kCommandBlock> w;
    w.Set<reg::kSequence>(sequence);
    w.Set<reg::kCommand>(name);
    w.Set<reg::kCommandSchema>(test::kSchema);
    w.Set<reg::kCommandWords>(test::kTableWords);
    w.Set<reg::kCommandCrc>(core::Crc32Words(table.data(), table.size()));
    return write(reg::kSequence.address, {w.data(), w.data() + w.size()});
  };
  Ask(write(reg::kUnlock.address, {0x6B6C, 0x6E75}));
  Ask(command(1, reg::kOpen));
  for (std::uint16_t at = 0; at < table.size(); at = static_cast<std::uint16_t>(at + 100))
    Ask(write(static_cast<std::uint16_t>(reg::kStagedTable.address + at),
              {table.begin() + at, table.begin() + std::min<std::ptrdiff_t>(at + 100, std::ssize(table))}));
  const std::uint32_t before = drive_.device.map().requests();
  const Bytes check = command(2, reg::kCheck);
  int held = 0;
  std::uint8_t reply[link::kMaxPdu];
  while (drive_.device.engine().Handle(check.data(), check.size(), reply) == link::kReplyLater && held < 100) {
    drive_.device.Step(0);
    ++held;
  }
  EXPECT_GE(held, 5);
  EXPECT_EQ(reply[0], 16);
  EXPECT_EQ(drive_.device.map().requests(), before + 1);
}

TEST_F(Engine, FunctionCode_NotServed_Gets01) {
  for (int function = 0; function < 256; ++function) {
    if (function == 3 || function == 4 || function == 6 || function == 16 || function == 23 || function == 43) continue;
    const auto code = static_cast<std::uint8_t>(function);
    EXPECT_EQ(Ask({code, 0, 0, 0, 1}), (Bytes{static_cast<std::uint8_t>(code | 0x80), 1})) << function;
  }
  EXPECT_EQ(Ask({43, 13, 1, 0}), (Bytes{0xAB, 1})) << "another encapsulated interface";
  EXPECT_EQ(Ask({}), Bytes{});
}

TEST_F(Engine, Quantity_OutOfRange_Gets03_EvenWhereTheAddressIsWrongToo) {
  for (const std::uint8_t function : {std::uint8_t{3}, std::uint8_t{4}}) {
    const auto exception = static_cast<std::uint8_t>(function | 0x80);
    EXPECT_EQ(Ask({function, 0x0F, 0xFF, 0, 0}), (Bytes{exception, 3}));
    EXPECT_EQ(Ask({function, 0x0F, 0xFF, 0, 126}), (Bytes{exception, 3}));
    EXPECT_EQ(Ask({function, 0, 0, 0}), (Bytes{exception, 3})) << "a byte short";
    EXPECT_EQ(Ask({function, 0, 0, 0, 1, 0}), (Bytes{exception, 3})) << "a byte too many";
  }
  EXPECT_EQ(Ask({16, 0, 0x20, 0, 0, 0}), (Bytes{0x90, 3}));
  EXPECT_EQ(Ask({16, 0, 0x20, 0, 1, 4, 0, 0, 0, 0}), (Bytes{0x90, 3})) << "byte count against quantity";
  EXPECT_EQ(Ask({16, 0, 0x20, 0, 2, 4, 0, 0}), (Bytes{0x90, 3})) << "byte count against length";
  Bytes many = {16, 0, 0x20, 0, 124, 248};
  many.resize(6 + 248);
  EXPECT_EQ(Ask(many), (Bytes{0x90, 3}));
}

TEST_F(Engine, Address_InAGapOrPastTheEnd_Gets02) {
  constexpr std::uint8_t gap = SpanOf(reg::kLibraryVersion).end();
  EXPECT_EQ(Ask({4, 0, gap, 0, 1}), (Bytes{0x84, 2}));
  EXPECT_EQ(Ask({4, 0, gap - 1, 0, 2}), (Bytes{0x84, 2})) << "runs into a gap";
  EXPECT_EQ(Ask({3, 0xFF, 0xFF, 0, 2}), (Bytes{0x83, 2})) << "wraps";
  EXPECT_EQ(Ask({16, 0xFF, 0xFF, 0, 2, 4, 0, 0, 0, 0}), (Bytes{0x90, 2}));
  EXPECT_EQ(Ask({6, 0x07, 0, 0, 1}), (Bytes{0x86, 2}));
  EXPECT_EQ(LastStatus(), core::Status::kBadAddress);
}

TEST_F(Engine, Write_OfHalfA32BitValueOrNaN_Gets03_AndChangesNothing) {
  const Bytes before = Ask({3, 0, 0x50, 0, 16});
  EXPECT_EQ(Ask({6, 0, 0x58, 0, 1}), (Bytes{0x86, 3}));
  EXPECT_EQ(Ask({16, 0, 0x59, 0, 2, 4, 0, 1, 0, 1}), (Bytes{0x90, 3})) << "two halves";
  EXPECT_EQ(Ask({16, 0, 0x50, 0, 1, 2, 0, 1}), (Bytes{0x90, 3}));
  EXPECT_EQ(LastStatus(), core::Status::kWrongSize);
  // The first float is good, the second is NaN (then infinity). Neither may be applied.
  EXPECT_EQ(Ask({16, 0, 0x50, 0, 4, 8, 0x3F, 0x80, 0, 0, 0x7F, 0xC0, 0, 0}), (Bytes{0x90, 3}));
  EXPECT_EQ(Ask({16, 0, 0x50, 0, 4, 8, 0x3F, 0x80, 0, 0, 0xFF, 0x80, 0, 0}), (Bytes{0x90, 3}));
  EXPECT_EQ(LastStatus(), core::Status::kNotFinite);
  EXPECT_EQ(Ask({3, 0, 0x50, 0, 16}), before);
  EXPECT_EQ(Ask({16, 0, 0x50, 0, 2, 4, 0x3F, 0x80, 0, 0}), (Bytes{16, 0, 0x50, 0, 2}));
}

TEST_F(Engine, Write_ToReadOnlyOrLocked_Gets04_WithTheReason) {
  EXPECT_EQ(Ask({6, 0x20, 0, 0, 1}), (Bytes{0x86, 4}));
  EXPECT_EQ(LastStatus(), core::Status::kReadOnly);
  EXPECT_EQ(Ask({6, 0x10, 0, 0, 1}), (Bytes{0x86, 4}));
  EXPECT_EQ(LastStatus(), core::Status::kLocked);
  const Bytes error = Ask({4, 0, 0x58, 0, 4});  // exception, function, address, status
  EXPECT_EQ(error, (Bytes{4, 8, 0, 4, 0, 6, 0x10, 0, 0, 8}));
}

TEST_F(Engine, WriteThenRead_WritesFirst_OrNotAtAll) {
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 2, 0, 0x21, 0, 1, 2, 0xAB, 0xCD}), (Bytes{23, 4, 0, 0, 0xAB, 0xCD}));
  const Bytes before = Ask({3, 0, 0x20, 0, 3});
  EXPECT_EQ(Ask({23, 0x0F, 0xFF, 0, 2, 0, 0x21, 0, 1, 2, 1, 1}), (Bytes{0x97, 2})) << "nothing to read there";
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 0, 0, 0x21, 0, 1, 2, 1, 1}), (Bytes{0x97, 3}));
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 126, 0, 0x21, 0, 1, 2, 1, 1}), (Bytes{0x97, 3}));
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 1, 0, 0x21, 0, 1, 4, 1, 1}), (Bytes{0x97, 3})) << "byte count against quantity";
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 1, 0, 0x21, 0, 1, 2, 1}), (Bytes{0x97, 3})) << "byte count against length";
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 1, 0, 0x21, 0, 0, 0}), (Bytes{0x97, 3}));
  EXPECT_EQ(Ask({23, 0, 0x20, 0, 1, 0x20, 0, 0, 1, 2, 1, 1}), (Bytes{0x97, 4})) << "read-only";
  Bytes many = {23, 0, 0x20, 0, 1, 0x10, 0, 0, 122, 244};
  many.resize(10 + 244);
  EXPECT_EQ(Ask(many), (Bytes{0x97, 3}));
  EXPECT_EQ(Ask({23}), (Bytes{0x97, 3}));
  EXPECT_EQ(Ask({3, 0, 0x20, 0, 3}), before);
}

TEST_F(Engine, ConnectionThatMayOnlyRead_IsForbiddenEveryWrite) {
  const auto ask = [&](const Bytes& request) {
    Bytes reply(link::kMaxPdu);
    reply.resize(drive_.device.engine().Handle(request.data(), request.size(), reply.data(), 0, link::Rights::kRead));
    return reply;
  };
  EXPECT_EQ(ask({3, 0, 0x20, 0, 1}), (Bytes{3, 2, 0, 0}));
  EXPECT_EQ(ask({4, 0, 0, 0, 2}), (Bytes{4, 4, 'A', 'R', 'M', 'C'}));
  EXPECT_EQ(ask({6, 0, 0x20, 0xAB, 0xCD}), (Bytes{0x86, 4}));
  EXPECT_EQ(ask({16, 0, 0x20, 0, 1, 2, 1, 2}), (Bytes{0x90, 4}));
  EXPECT_EQ(ask({23, 0, 0x20, 0, 1, 0, 0x21, 0, 1, 2, 1, 2}), (Bytes{0x97, 4}));
  EXPECT_EQ(LastStatus(), core::Status::kForbidden);
  EXPECT_EQ(drive_.device.map().last_error().address, 0x21);
  EXPECT_EQ(ask({6}), (Bytes{0x86, 4}));
  EXPECT_EQ(ask({3, 0, 0x20, 0, 2}), (Bytes{3, 4, 0, 0, 0, 0}));
}

TEST_F(Engine, Overview_IsIdentityAndState) {
  const Bytes overview = Ask({4, 0x0C, 0, 0, 82}), identity = Ask({4, 0, 0, 0, 26}), state = Ask({4, 0, 0x40, 0, 56});
  ASSERT_EQ(overview.size(), 2u + 164);
  EXPECT_TRUE(std::equal(identity.begin() + 2, identity.end(), overview.begin() + 2));
  Bytes different = state, same(overview.begin() + 2 + 52, overview.end());
  different.erase(different.begin(), different.begin() + 2);
  ASSERT_EQ(different.size(), same.size());
  for (std::size_t k = 0; k < same.size(); ++k) {
    if (k / 2 == 0x57 - 0x40) continue;  // the count of requests has changed
    EXPECT_EQ(same[k], different[k]) << k;
  }
  EXPECT_EQ(Ask({4, 0x0C, 25, 0, 2}), (Bytes{4, 4, overview[52], overview[53], overview[54], overview[55]}));
}

TEST_F(Engine, LastErrorAddress_IsTheFirstRegisterOfTheRefusedRequest) {
  Ask({4, 0x34, 0x56, 0, 1});
  EXPECT_EQ(drive_.device.map().last_error().address, 0x3456);
  EXPECT_EQ(drive_.device.map().last_error().request, drive_.device.map().requests());
}

TEST_F(Engine, DeviceIdentification_NamesVendorProductAndRevision) {
  const Bytes all = Ask({43, 14, 1, 0});
  const std::string text(all.begin(), all.end());
  EXPECT_EQ(all[6], 3);
  EXPECT_NE(text.find("armcal"), std::string::npos);
  EXPECT_NE(text.find("test_arm"), std::string::npos);
  EXPECT_EQ(Ask({43, 14, 4, 2}), (Bytes{43, 14, 4, 0x81, 0, 0, 1, 2, 3, '1', '.', '0'}));
  EXPECT_EQ(Ask({43, 14, 4, 3}), (Bytes{0xAB, 2}));
  EXPECT_EQ(Ask({43, 14, 5, 0}), (Bytes{0xAB, 3}));
  EXPECT_EQ(Ask({43, 14, 1}), (Bytes{0xAB, 3}));
}

TEST_F(Engine, RandomRequests_GetLawfulReplies_AndLeaveTheActiveTableAlone) {
  std::mt19937 random(11);
  const std::uint8_t functions[] = {3, 4, 6, 16, 43, 23, 16};
  for (int i = 0; i < 200000; ++i) {
    Bytes request(random() % 24);
    for (auto& byte : request) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 8);
    if (!request.empty() && random() % 8 != 0) request[0] = functions[random() % 7];
    const Bytes reply = Ask(request);
    if (request.empty()) continue;
    ASSERT_GE(reply.size(), 2u);
    ASSERT_LE(reply.size(), link::kMaxPdu);
    const bool exception = reply[0] == (request[0] | 0x80) && reply.size() == 2 && reply[1] >= 1 && reply[1] <= 6;
    ASSERT_TRUE(exception || reply[0] == request[0]);
  }
  EXPECT_EQ(drive_.application.adoptions, 0);
  EXPECT_EQ(drive_.active, std::vector<std::uint16_t>(test::kTableWords));
}

}  // namespace
