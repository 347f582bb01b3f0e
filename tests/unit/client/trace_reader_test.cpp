// client - tests traces over the wire: complete, with losses, read twice, and started again by another client.
#include "host_sim/client/trace_reader.hpp"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/unit/client/test_server.hpp"

namespace {

using namespace armcal;
using client::Gaps;
using client::StartTrace;
using client::TraceMode;
using client::TraceReader;
using client::TraceRecords;
using client::TraceRequest;
namespace reg = link::reg;

constexpr std::uint32_t kMask = 0x0F;  // four words a record

std::uint16_t WordOf(std::uint32_t tick, std::size_t word) { return static_cast<std::uint16_t>(31 * tick + word); }

// Makes the drive tick up to 50 times in each turn of its loop, up to tick `until`.
struct Ticking {
  std::atomic<std::uint32_t> until{0};
  std::uint32_t tick = 0;

  void operator()(test::TestDevice& drive) {
    for (int i = 0; i < 50 && tick < until; ++i, ++tick) {
      const link::TraceTurn turn = drive.raw.Offer(tick);
      if (!turn.last) continue;
      std::uint16_t record[8];
      for (std::size_t w = 0; w < 8; ++w) record[w] = WordOf(tick, w);
      static_cast<void>(drive.raw.Push(record, 3));
    }
  }
};

void ExpectRight(const TraceRecords& records) {
  ASSERT_EQ(records.words.size(), records.count() * records.record_words);
  for (std::size_t r = 0; r < records.count(); ++r)
    for (std::size_t w = 0; w < records.record_words; ++w)
      ASSERT_EQ(records.words[r * records.record_words + w], WordOf(records.ticks[r], w));
}

TEST(TraceReader, StreamWithALimit_ArrivesCompleteAndInOrder) {
  Ticking ticking;
  test::TestServer server([&](test::TestDevice& drive) {
    if (drive.raw.waiting() < 50) ticking(drive);  // a simulated drive may wait for room
  });
  auto drive = server.Connect();
  StartTrace(drive, 0, {TraceMode::kStreaming, 1, 5, 1000, kMask});
  ticking.until = 5000;
  TraceReader reader(drive, 0, Gaps::kRefuse);
  const TraceRecords records = reader.TakeAll();
  ASSERT_EQ(records.count(), 1000u);
  EXPECT_EQ(records.record_words, 4);
  EXPECT_EQ(records.ticks.front(), 5u);
  EXPECT_EQ(records.ticks.back(), 1004u);
  EXPECT_EQ(records.lost, 0u);
  EXPECT_EQ(records.generations.back(), 3);
  ExpectRight(records);
}

TEST(TraceReader, StreamThatOverran_ReportsLossAndGap) {
  Ticking ticking;
  test::TestServer server([&](test::TestDevice& drive) { ticking(drive); });
  auto drive = server.Connect();
  StartTrace(drive, 0, {TraceMode::kStreaming, 1, 0, 0, kMask});
  const std::uint32_t capacity = 1024 / (4 + 3);
  TraceReader reader(drive, 0);
  TraceRecords records;
  ticking.until = 2 * capacity;
  ASSERT_TRUE(test::Await([&] { return drive.ReadValue<reg::kTraceLost>() == capacity; }));
  while (reader.TakePage(records) != 0) {
  }
  ASSERT_EQ(records.count(), capacity);
  ticking.until = 2 * capacity + 10;
  ASSERT_TRUE(test::Await([&] { return reader.TakePage(records) != 0; }));
  EXPECT_EQ(records.lost, capacity);
  EXPECT_EQ(records.ticks[capacity], 2 * capacity);
  ExpectRight(records);
}

TEST(TraceReader, GapInTime_IsRefusedIfAsked) {
  Ticking ticking;
  test::TestServer server([&](test::TestDevice& drive) { ticking(drive); });
  auto drive = server.Connect();
  StartTrace(drive, 0, {TraceMode::kStreaming, 1, 0, 0, kMask});
  TraceReader strict(drive, 0, Gaps::kRefuse);
  TraceRecords records;
  ticking.until = 400;  // overruns the ring of 146
  ASSERT_TRUE(test::Await([&] { return drive.ReadValue<reg::kTraceLost>() == 400 - 146; }));
  while (strict.TakePage(records) != 0) {
  }
  EXPECT_EQ(records.count(), 146u);
  ticking.until = 410;
  EXPECT_THROW(static_cast<void>(test::Await([&] { return strict.TakePage(records) != 0; })), client::LinkError);
}

TEST(TraceReader, PageReadTwice_IsTheSame) {
  Ticking ticking;
  test::TestServer server([&](test::TestDevice& drive) { ticking(drive); });
  auto drive = server.Connect();
  StartTrace(drive, 0, {TraceMode::kStreaming, 1, 0, 0, kMask});
  ticking.until = 20;
  ASSERT_TRUE(test::Await([&] { return drive.ReadValue<reg::kTraceCount>() != 0; }));
  // The header from `lost` on changes while records arrive.
  const link::Span fixed = Between(reg::kTraceFirstRecord, reg::kTraceRecordWords);
  const auto header = drive.Read(fixed);
  const link::Span data_words =
      SpanOf(reg::kTraceData, drive.ReadValue<reg::kTraceCount>() * drive.ReadValue<reg::kTraceRecordWords>());
  const auto data = drive.Read(data_words);
  ticking.until = 60;  // more arrives meanwhile
  ASSERT_TRUE(test::Await([&] { return drive.ReadValue<reg::kTraceWaiting>() >= 40; }));
  EXPECT_EQ(drive.Read(fixed), header);
  EXPECT_EQ(drive.Read(data_words), data);
}

TEST(TraceReader, OneShotWithDecimation_IsStampedByWindow) {
  Ticking ticking;
  test::TestServer server([&](test::TestDevice& drive) { ticking(drive); });
  auto drive = server.Connect();
  StartTrace(drive, 0, {TraceMode::kOneShot, 10, 100, 12, kMask});
  ticking.until = 500;
  const TraceRecords records = TraceReader(drive, 0).TakeAll();
  ASSERT_EQ(records.count(), 12u);
  EXPECT_EQ(records.tick_step, 10u);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(records.ticks[i], 100 + 10 * i);
}

TEST(TraceReader, StartedAnewByAnotherClient_IsNoticed) {
  test::TestServer server;
  auto drive = server.Connect(), other = server.Connect();
  StartTrace(drive, 1, {TraceMode::kStreaming, 1, 0, 0, kMask});
  TraceReader reader(drive, 1);
  TraceRecords records;
  EXPECT_EQ(reader.TakePage(records), 0u);
  EXPECT_THROW(StartTrace(other, 1, {TraceMode::kStreaming, 1, 0, 0, kMask}), client::RefusedError);
  server.Jump(link::Sessions::kPatience_ms);  // its owner has been silent for so long
  ASSERT_TRUE(test::Await([&] {
    try {
      StartTrace(other, 1, {TraceMode::kStreaming, 1, 0, 0, kMask});
      return true;
    } catch (const client::RefusedError&) {
      return false;  // the server has not seen the new time yet
    }
  }));
  EXPECT_THROW(reader.TakePage(records), client::LinkError);
}

TEST(TraceReader, ChannelsThatTheDriveLacks_AreRefused) {
  test::TestServer server;
  auto drive = server.Connect();
  EXPECT_THROW(StartTrace(drive, 0, {TraceMode::kStreaming, 1, 0, 0, 0x100}), client::RefusedError);
}

}  // namespace
