// link - the trace ring: pages read twice, losses, gaps, new recordings, and producer and reader as two threads.
#include "armcal/link/trace.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
using link::Recording;
using link::Trace;
using link::TraceMode;
using link::TraceState;

constexpr std::uint16_t kWordsPerRecord = 5;
constexpr std::uint32_t kMask = 0x1F;  // five channels
using Ring = link::TraceRing<160>;     // 160 / (5 + 3) = 20 records
constexpr std::uint32_t kRecords = 20;

Recording Streaming(std::uint16_t number = 1) { return {number, TraceMode::kStreaming, 1, 0, 0, kMask, 0}; }

// Each word of a record says which tick and which place it belongs to.
std::uint16_t WordOf(std::uint32_t tick, std::uint32_t word) { return static_cast<std::uint16_t>(17 * tick + word); }

Status Produce(Trace& trace, std::uint32_t tick, std::uint32_t generation = 1) {
  const link::TraceTurn turn = trace.Offer(tick);
  if (!turn.last) return Status::kEmpty;
  std::uint16_t record[kWordsPerRecord];
  for (std::uint32_t w = 0; w < kWordsPerRecord; ++w) record[w] = WordOf(tick, w);
  return trace.Push(record, generation);
}

// Reads the page in portions that do not fit the records, and checks every word.
void ExpectPage(Trace& trace, std::uint32_t first_record, std::uint32_t first_tick, std::uint32_t count) {
  const link::TracePage page = trace.Page();
  EXPECT_EQ(page.first_record, first_record);
  EXPECT_EQ(page.count, count);
  if (count == 0) return;
  EXPECT_EQ(page.first_tick, first_tick);
  const std::uint32_t total = count * kWordsPerRecord;
  for (std::uint32_t at = 0; at < total;) {
    const auto part = static_cast<std::uint16_t>(std::min<std::uint32_t>(7, total - at));
    std::uint16_t words[7];
    ASSERT_EQ(trace.ReadPage(at, part, words), Status::kOk);
    for (std::uint32_t i = 0; i < part; ++i)
      ASSERT_EQ(words[i], WordOf(first_tick + (at + i) / kWordsPerRecord, (at + i) % kWordsPerRecord));
    at += part;
  }
  std::uint16_t beyond;
  EXPECT_EQ(trace.ReadPage(total, 1, &beyond), Status::kBadAddress);
}

TEST(Trace, Page_StaysAsItIsUntilAcknowledged) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming()), Status::kOk);
  EXPECT_EQ(trace.state(), TraceState::kWaiting);
  for (std::uint32_t tick = 100; tick < 105; ++tick) EXPECT_EQ(Produce(trace, tick), Status::kOk);
  ExpectPage(trace, 0, 100, 5);
  for (std::uint32_t tick = 105; tick < 110; ++tick) EXPECT_EQ(Produce(trace, tick), Status::kOk);
  ExpectPage(trace, 0, 100, 5);
  EXPECT_EQ(trace.waiting(), 5u);
  EXPECT_EQ(trace.Acknowledge(5), Status::kOk);
  EXPECT_EQ(trace.Acknowledge(5), Status::kOk) << "a repeated acknowledge";
  ExpectPage(trace, 5, 105, 5);
  EXPECT_EQ(trace.Acknowledge(7), Status::kOk) << "part of a page";
  ExpectPage(trace, 7, 107, 3);
  EXPECT_EQ(trace.Acknowledge(11), Status::kOutOfRange);
  ExpectPage(trace, 7, 107, 3);
}

TEST(Trace, Window_ShowsTheWholeRecordsThatFit_AndZerosBehindThem) {
  namespace reg = link::reg;
  link::TraceRing<400> trace(1, &test::RecordWords, nullptr);  // 50 records
  const auto window = [&] {
    link::Words<reg::kWindowBlock> w;
    EXPECT_EQ(trace.ReadWindow(0, w.size(), w.data()), Status::kOk);
    return w;
  };
  EXPECT_EQ(window().Get<reg::kWindowCount>(), 0) << "no recording yet";
  ASSERT_EQ(trace.Start(Streaming(7)), Status::kOk);
  for (std::uint32_t tick = 100; tick < 130; ++tick) (void)Produce(trace, tick, 3);
  for (int look = 0; look < 2; ++look) {  // it stays
    const auto w = window();
    EXPECT_EQ(w.Get<reg::kWindowFirstRecord>(), 0u);
    EXPECT_EQ(w.Get<reg::kWindowFirstTick>(), 100u);
    EXPECT_EQ(w.Get<reg::kWindowCount>(), 22) << "22 * 5 of 114 registers";
    EXPECT_EQ(w.Get<reg::kWindowWaiting>(), 8);
    EXPECT_EQ(w.Get<reg::kWindowRecording>(), 7);
    EXPECT_EQ(w.Get<reg::kWindowGeneration>(), 3);
    for (std::uint32_t k = 0; k < 114; ++k) EXPECT_EQ(w.data()[11 + k], k < 110 ? WordOf(100 + k / 5, k % 5) : 0) << k;
    std::uint16_t part[4];
    EXPECT_EQ(trace.ReadWindow(9, 4, part), Status::kOk);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(part[k], w.data()[9 + k]);
  }
  ASSERT_EQ(trace.Acknowledge(22), Status::kOk);
  EXPECT_EQ(window().Get<reg::kWindowFirstRecord>(), 22u);
  EXPECT_EQ(window().Get<reg::kWindowCount>(), 8);
  EXPECT_EQ(window().Get<reg::kWindowWaiting>(), 0);
}

TEST(Trace, WhenFull_RefusesTheNewRecord_CountsIt_AndThePageEndsAtTheGap) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming()), Status::kOk);
  for (std::uint32_t tick = 0; tick < kRecords; ++tick) ASSERT_EQ(Produce(trace, tick), Status::kOk);
  for (std::uint32_t tick = kRecords; tick < kRecords + 6; ++tick) ASSERT_EQ(Produce(trace, tick), Status::kFull);
  EXPECT_EQ(trace.lost(), 6u);
  ExpectPage(trace, 0, 0, kRecords);
  ASSERT_EQ(trace.Acknowledge(10), Status::kOk);
  for (std::uint32_t tick = kRecords + 6; tick < kRecords + 10; ++tick) ASSERT_EQ(Produce(trace, tick), Status::kOk);
  ExpectPage(trace, 10, 10, 10);
  ASSERT_EQ(trace.Acknowledge(20), Status::kOk);
  ExpectPage(trace, 20, kRecords + 6, 4);
  EXPECT_EQ(trace.lost(), 6u);
}

TEST(Trace, OneShot_EndsWhenFull_AndLosesNothing) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start({1, TraceMode::kOneShot, 1, 0, 0, kMask, 0}), Status::kOk);
  for (std::uint32_t tick = 0; tick < 3 * kRecords; ++tick) static_cast<void>(Produce(trace, tick));
  EXPECT_EQ(trace.state(), TraceState::kDone);
  EXPECT_EQ(trace.lost(), 0u);
  ExpectPage(trace, 0, 0, kRecords);
}

TEST(Trace, StartTickAndLimit_BoundTheRecording) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start({1, TraceMode::kStreaming, 1, 50, 7, kMask, 0}), Status::kOk);
  for (std::uint32_t tick = 40; tick < 50; ++tick) EXPECT_FALSE(trace.Offer(tick).recording);
  EXPECT_EQ(trace.state(), TraceState::kWaiting);
  for (std::uint32_t tick = 50; tick < 70; ++tick) static_cast<void>(Produce(trace, tick));
  EXPECT_EQ(trace.state(), TraceState::kDone);
  ExpectPage(trace, 0, 50, 7);
}

TEST(Trace, Decimation_TellsFirstAndLastOfEachWindow_AndStampsItsFirstTick) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start({1, TraceMode::kStreaming, 4, 8, 0, kMask, 0}), Status::kOk);
  const std::uint16_t record[kWordsPerRecord] = {};
  for (std::uint32_t tick = 8; tick < 24; ++tick) {
    const link::TraceTurn turn = trace.Offer(tick);
    EXPECT_EQ(turn.first, tick % 4 == 0);
    EXPECT_EQ(turn.last, tick % 4 == 3);
    if (turn.last) {
      EXPECT_EQ(trace.Push(record, 1), Status::kOk);
    }
  }
  EXPECT_EQ(trace.Page().first_tick, 8u);
  EXPECT_EQ(trace.Page().count, 4u);
  EXPECT_EQ(trace.record_ticks(), 4u);
}

TEST(Trace, MissingTick_EndsThePage) {
  Ring trace(8, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming()), Status::kOk);
  for (const std::uint32_t tick : {0u, 8u, 16u, 32u, 40u}) ASSERT_EQ(Produce(trace, tick), Status::kOk);
  EXPECT_EQ(trace.Page().count, 3u);
  ASSERT_EQ(trace.Acknowledge(3), Status::kOk);
  EXPECT_EQ(trace.Page().first_tick, 32u);
  EXPECT_EQ(trace.Page().count, 2u);
}

TEST(Trace, MissingTickInsideAWindow_BeginsTheWindowAnew) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start({1, TraceMode::kStreaming, 4, 0, 0, kMask, 0}), Status::kOk);
  static_cast<void>(trace.Offer(0));
  static_cast<void>(trace.Offer(1));
  EXPECT_TRUE(trace.Offer(3).first) << "ticks 0, 1, 3, 4 must never be averaged into one record";
  static_cast<void>(trace.Offer(4));
  static_cast<void>(trace.Offer(5));
  EXPECT_TRUE(trace.Offer(6).last);
  const std::uint16_t record[kWordsPerRecord] = {};
  ASSERT_EQ(trace.Push(record, 1), Status::kOk);
  EXPECT_EQ(trace.Page().first_tick, 3u);
}

TEST(Trace, NewGeneration_EndsThePage) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming()), Status::kOk);
  for (std::uint32_t tick = 0; tick < 6; ++tick) ASSERT_EQ(Produce(trace, tick, tick < 4 ? 7 : 8), Status::kOk);
  EXPECT_EQ(trace.Page().count, 4u);
  EXPECT_EQ(trace.Page().generation, 7u);
  ASSERT_EQ(trace.Acknowledge(4), Status::kOk);
  EXPECT_EQ(trace.Page().generation, 8u);
}

TEST(Trace, NewRecording_DropsTheOldRecords_AndOffStops) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming(1)), Status::kOk);
  for (std::uint32_t tick = 0; tick < 9; ++tick) ASSERT_EQ(Produce(trace, tick), Status::kOk);
  ASSERT_EQ(trace.Page().count, 9u);
  ASSERT_EQ(trace.Start(Streaming(2)), Status::kOk);
  EXPECT_EQ(trace.Page().count, 0u) << "the producer has not taken it over yet";
  for (std::uint32_t tick = 20; tick < 23; ++tick) ASSERT_EQ(Produce(trace, tick), Status::kOk);
  ExpectPage(trace, 0, 20, 3);
  Recording off;
  ASSERT_EQ(trace.Start(off), Status::kOk);
  EXPECT_FALSE(trace.Offer(23).recording);
  EXPECT_EQ(trace.state(), TraceState::kOff);
  EXPECT_EQ(trace.Page().count, 0u);
  std::uint16_t word;
  EXPECT_EQ(trace.ReadPage(0, 1, &word), Status::kBadAddress);
}

TEST(Trace, Recording_ThatCannotBe_IsRefusedAndLeavesTheOldOne) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start(Streaming(5)), Status::kOk);
  EXPECT_EQ(trace.Start({6, TraceMode::kStreaming, 0, 0, 0, kMask, 0}), Status::kOutOfRange);
  EXPECT_EQ(trace.Start({6, static_cast<TraceMode>(9), 1, 0, 0, kMask, 0}), Status::kOutOfRange);
  EXPECT_EQ(trace.Start({6, TraceMode::kStreaming, 1, 0, 0, 0x100, 0}), Status::kOutOfRange);
  EXPECT_EQ(trace.requested().number, 5);
}

TEST(Trace, TickNearItsWrap_IsNoGap) {
  Ring trace(1, &test::RecordWords, nullptr);
  ASSERT_EQ(trace.Start({1, TraceMode::kStreaming, 1, 0xFFFFFFFCu, 0, kMask, 0}), Status::kOk);
  for (std::uint32_t i = 0; i < 8; ++i) ASSERT_EQ(Produce(trace, 0xFFFFFFFCu + i), Status::kOk);
  ExpectPage(trace, 0, 0xFFFFFFFCu, 8);
}

TEST(Trace, BetweenTwoThreads_EveryRecordIsRightOrCounted) {
  static Ring trace(1, &test::RecordWords, nullptr);
  constexpr std::uint32_t kTicks = 200000;
  ASSERT_EQ(trace.Start(Streaming()), Status::kOk);
  std::atomic<bool> done{false};
  std::thread producer([&] {
    for (std::uint32_t tick = 0; tick < kTicks; ++tick)
      if (!core::IsOk(Produce(trace, tick))) std::this_thread::yield();
    done = true;
  });
  std::uint32_t next = 0, received = 0;
  bool sound = true;
  for (bool finished = false;;) {
    finished = done;
    const link::TracePage page = trace.Page();
    if (page.count == 0 && finished) break;
    if (page.count == 0) {
      std::this_thread::yield();
      continue;
    }
    sound = sound && page.first_record == next;
    for (std::uint32_t w = 0; w < page.count * std::uint32_t{kWordsPerRecord}; ++w) {
      std::uint16_t word = 0;
      sound = sound && core::IsOk(trace.ReadPage(w, 1, &word)) &&
              word == WordOf(page.first_tick + w / kWordsPerRecord, w % kWordsPerRecord);
    }
    received += page.count;
    next = page.first_record + page.count;
    sound = sound && core::IsOk(trace.Acknowledge(next));
  }
  producer.join();
  EXPECT_TRUE(sound);
  EXPECT_EQ(received + trace.lost(), kTicks);
}

}  // namespace
