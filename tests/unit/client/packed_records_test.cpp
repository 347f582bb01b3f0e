// client - packs motions whose every position is known, unpacks them, and compares.
#include "host_sim/client/packed_records.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "armcal/controller/trace_records.hpp"
#include "armcal/core/words.hpp"
#include "host_sim/client/errors.hpp"
#include "tests/unit/client/test_server.hpp"

namespace {

using namespace armcal;
constexpr int n = 6, kTicks = 8;

struct Truth {
  std::vector<std::int32_t> counts[n];  // in each tick
  std::vector<std::int16_t> current[n];
  std::vector<std::uint8_t> flags[n];
};

// `speed`: of a joint, in counts a tick, at a tick.
Truth Motion(int records, const std::function<double(int joint, int tick)>& speed) {
  std::mt19937 random(3);
  Truth truth;
  for (int j = 0; j < n; ++j) {
    double at = -2e8 + 7e7 * j;
    for (int k = 0; k < kTicks * records; ++k) {
      at += speed(j, k);
      truth.counts[j].push_back(static_cast<std::int32_t>(std::lround(at)));
      truth.current[j].push_back(static_cast<std::int16_t>(random()));
      truth.flags[j].push_back(
          static_cast<std::uint8_t>(model::kEnabled | (k / 50 % 3 == j % 3 ? model::kSaturated : 0)));
    }
  }
  return truth;
}

client::TraceRecords Pack(const Truth& truth) {
  client::TraceRecords out;
  out.record_words = controller::RawRecordWords<n>(controller::kRawPacked);
  out.tick_step = kTicks;
  out.channels = controller::kRawPacked;
  controller::PackedHistory<n> history;
  const float nothing[n] = {};
  for (std::size_t k = 0; k + kTicks <= truth.counts[0].size(); k += kTicks) {
    controller::RawRecord<n> record;
    for (std::size_t i = k; i < k + kTicks; ++i) {
      model::RawSample<n> raw;
      for (int j = 0; j < n; ++j)
        raw.counts[j] = truth.counts[j][i], raw.current[j] = truth.current[j][i], raw.flags[j] = truth.flags[j][i];
      record.Add(raw, nothing, nothing);
    }
    std::uint16_t words[64];
    record.WritePacked(history, words);
    out.ticks.push_back(static_cast<std::uint32_t>(k));
    out.generations.push_back(1);
    out.words.insert(out.words.end(), words, words + out.record_words);
  }
  return out;
}

// Compares all records but those whose flags say stale; returns how many those are, of all joints.
int ExpectTrue(const client::Unpacked& unpacked, const Truth& truth) {
  const client::TraceRecords& r = unpacked.records;
  int stale = 0;
  for (std::size_t k = 0; k < r.count(); ++k)
    for (int j = 0; j < n; ++j) {
      const std::uint16_t* w = &r.words[k * r.record_words + 5 * j];
      double counts = 0, current = 0;
      std::uint8_t any = 0;
      for (std::size_t i = r.ticks[k]; i < r.ticks[k] + kTicks; ++i)
        counts += truth.counts[j][i], current += truth.current[j][i],
            any = static_cast<std::uint8_t>(any | truth.flags[j][i]);
      EXPECT_NEAR(static_cast<std::int32_t>(core::GetU32(w + 2)) / 16.0, current / kTicks, 0.5 / 4 + 1.0 / 32);
      if ((w[4] & model::kStale) != 0) {
        ++stale;
        continue;
      }
      // counts in sixteenths wrap at 2^28 counts, in plain records, too
      EXPECT_NEAR(std::remainder(core::GetU32(w) / 16.0 - counts / kTicks, 268435456.0), 0, 1.0 / 32)
          << k << " joint " << j;
      EXPECT_EQ(w[4], any) << k << " joint " << j;
    }
  return stale;
}

TEST(PackedRecords, OfSixJoints_TakeSixteenRegisters) {
  EXPECT_EQ(controller::RawRecordWords<6>(controller::kRawPacked), 16);
  EXPECT_EQ(controller::RawRecordWords<7>(controller::kRawPacked), 19);
}

// In motion from the first record on, much faster than 20 bits can tell, and over the wrap of 32 bits.
TEST(PackedRecords, FastSmoothMotion_ComesBackToTheSixteenthOfACount) {
  const Truth truth = Motion(400, [](int j, int k) { return 20000.0 * (j - 2) + 9000 * std::sin(0.01 * k + j); });
  const client::Unpacked unpacked = client::Unpack(Pack(truth), n);
  EXPECT_EQ(unpacked.unknown, 0u);
  EXPECT_EQ(ExpectTrue(unpacked, truth), 0);
}

TEST(PackedRecords, ChangeBeyondTheRange_IsMarked_AndWhatFollowsIsRight) {
  const Truth truth = Motion(300, [](int j, int k) { return j == 1 && k >= 800 ? 90000.0 : 10.0; });
  const client::Unpacked unpacked = client::Unpack(Pack(truth), n);
  EXPECT_LE(unpacked.unknown, 1u) << "the record between the two in which the speed changes";
  const int stale = ExpectTrue(unpacked, truth);
  EXPECT_GE(stale, 1);
  EXPECT_LE(stale, 2);
}

TEST(PackedRecords, StaleReadings_CostOnlyThemselves_UnlessTheyComeTooOften) {
  Truth truth = Motion(300, [](int, int k) { return 500 * std::sin(0.02 * k); });
  for (int record : {50, 100, 120}) truth.flags[2][kTicks * record + 3] |= model::kStale;
  const client::Unpacked few = client::Unpack(Pack(truth), n);
  EXPECT_EQ(few.unknown, 0u);
  EXPECT_EQ(ExpectTrue(few, truth), 3);
  for (int record = 200; record < 230; record += 3) truth.flags[4][kTicks * record] |= model::kStale;
  const client::Unpacked many = client::Unpack(Pack(truth), n);
  EXPECT_GT(many.unknown, 0u);
  EXPECT_LT(ExpectTrue(many, truth), 3 + 36);
}

TEST(PackedRecords, GapInTime_IsNotBridged) {
  const Truth truth = Motion(200, [](int j, int) { return 3000.0 * j; });
  client::TraceRecords packed = Pack(truth);
  packed.ticks.erase(packed.ticks.begin() + 90, packed.ticks.begin() + 101);
  packed.generations.resize(packed.ticks.size());
  packed.words.erase(packed.words.begin() + 90 * packed.record_words, packed.words.begin() + 101 * packed.record_words);
  const client::Unpacked unpacked = client::Unpack(packed, n);
  EXPECT_EQ(unpacked.unknown, 0u);
  EXPECT_EQ(ExpectTrue(unpacked, truth), 0);
}

TEST(PackedRecords, ThatContradictEachOther_AreRefused) {
  client::TraceRecords packed = Pack(Motion(100, [](int, int) { return 5.0; }));
  packed.words[40 * packed.record_words + 15] ^= 0x0008;  // the highest bits of one joint
  EXPECT_THROW(client::Unpack(packed, n), client::LinkError);
  EXPECT_THROW(client::Unpack(packed, n + 1), client::LinkError);
}

// A window is acknowledged by the request for the next one.
TEST(TraceWindow, StreamTakenByWindows_IsThatTakenByPages) {
  std::atomic<std::uint32_t> until{0};
  std::uint32_t tick = 0;
  test::TestServer server([&](test::TestDevice& drive) {
    for (int i = 0; i < 20 && tick < until && (tick == 0 || drive.raw.room() > 1); ++i, ++tick) {
      if (!drive.raw.Offer(tick).last) continue;
      std::uint16_t record[8];
      for (int w = 0; w < 8; ++w) record[w] = static_cast<std::uint16_t>(31 * tick + w);
      static_cast<void>(drive.raw.Push(record, tick < 300 ? 3 : 4));  // an adoption ends a page
    }
  });
  auto drive = server.Connect();
  client::StartTrace(drive, 0, {client::TraceMode::kStreaming, 1, 0, 500, 0xFF});
  until = 600;
  client::TraceReader reader(drive, 0, client::Gaps::kRefuse, client::Taking::kWindow);
  const client::TraceRecords records = reader.TakeAll();
  ASSERT_EQ(records.count(), 500u);
  EXPECT_EQ(records.lost, 0u);
  for (std::size_t k = 0; k < 500; ++k) {
    EXPECT_EQ(records.ticks[k], k);
    EXPECT_EQ(records.generations[k], k < 300 ? 3 : 4);
    for (std::size_t w = 0; w < 8; ++w) EXPECT_EQ(records.words[8 * k + w], static_cast<std::uint16_t>(31 * k + w));
  }
}

}  // namespace
