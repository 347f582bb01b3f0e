// client - the log of a trace whose counts are known, far from zero and over a wrap of the record.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "armcal/controller/trace_records.hpp"
#include "armcal/core/words.hpp"
#include "host_sim/client/recording.hpp"

namespace armcal::client {
namespace {

// Joint 1 begins 1000 counts from its zero, which is at 2e8 counts. Joint 2 goes on from its zero, at -2e8 counts,
// until it is 3e8 counts away. A record holds sixteenths of a count, modulo 2^32: 2.7e8 counts.
TEST(RawLog, OfAnEncoderWhoseZeroIsFarAway_CountsFromThere) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  robot.joint[0].motor.zero_counts = 200000000, robot.joint[1].motor.zero_counts = -200000000;
  constexpr int kRecords = 400;
  const auto counts = [](int j, int k) { return j == 0 ? 2e8 + 1000 + 7 * k : -2e8 + 3e8 * k / (kRecords - 1); };
  TraceRecords records;
  records.record_words = 10, records.tick_step = 8, records.channels = controller::kRawMotion | controller::kRawFlags;
  for (int k = 0; k < kRecords; ++k) {
    records.ticks.push_back(static_cast<std::uint32_t>(8 * k));
    records.generations.push_back(1);
    for (int j = 0; j < 2; ++j) {
      std::uint16_t words[5] = {};
      core::PutU32(words, static_cast<std::uint32_t>(std::llround(16 * counts(j, k))));
      records.words.insert(records.words.end(), words, words + 5);
    }
  }
  std::uint32_t first = 0;
  const logs::Log log = RawLog(records, robot, {0, 8 * kRecords}, first);
  ASSERT_EQ(log.samples(), kRecords);
  for (int j = 0; j < 2; ++j) {
    const auto& motor = robot.joint[static_cast<std::size_t>(j)].motor;
    const double rad = 2 * std::numbers::pi / (motor.counts_per_turn * motor.gear_ratio);
    for (int k = 0; k < kRecords; ++k)
      EXPECT_NEAR(log.q(k, j), rad * (counts(j, k) - motor.zero_counts), rad / 16) << k << " joint " << j + 1;
  }
}

}  // namespace
}  // namespace armcal::client
