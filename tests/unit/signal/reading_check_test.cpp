// signal - which readings an arm cannot have made: what is refused, for how long, and what is not.
#include "armcal/signal/reading_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "armcal/signal/signal_path.hpp"

namespace armcal::signal {
namespace {

constexpr double kCount_rad = 4e-7;

// Counts of an axis that swings: at most 1 rad/s and 3 rad/s^2, rounded.
std::vector<std::int32_t> Swing(int ticks, double noise_counts = 0) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<std::int32_t> counts;
  for (int k = 0; k < ticks; ++k)
    counts.push_back(static_cast<std::int32_t>(
        std::lround(std::sin(3e-3 * k + 0.4) / 3 / kCount_rad + noise_counts * normal(random))));
  return counts;
}

// The ticks that are refused.
std::vector<int> Refused(const std::vector<std::int32_t>& counts) {
  CountCheck check;
  check.Start(static_cast<float>(kCount_rad), 1000.0f);
  std::vector<int> refused;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (!check.Check(counts[k], 0)) refused.push_back(static_cast<int>(k));
  return refused;
}
std::vector<int> Range(int from, int to) {
  std::vector<int> range;
  for (int k = from; k < to; ++k) range.push_back(k);
  return range;
}

TEST(CountCheck, SmoothMotion_IsNeverRefused) {
  EXPECT_TRUE(Refused(Swing(20000)).empty());
  EXPECT_TRUE(Refused(Swing(20000, 3)).empty());
}

TEST(CountCheck, FlippedBit_RefusesThatTickAlone) {
  for (int bit = 8; bit < 32; ++bit) {
    auto counts = Swing(3000);
    counts[1500] = static_cast<std::int32_t>(static_cast<std::uint32_t>(counts[1500]) ^ (1u << bit));
    EXPECT_EQ(Refused(counts), Range(1500, 1501)) << bit;
  }
}

TEST(CountCheck, RepeatedAndSwappedFrames_AreRefused) {
  auto repeated = Swing(3000), swapped = repeated;
  repeated[1600] = repeated[1599];
  EXPECT_EQ(Refused(repeated), Range(1600, 1601));
  std::swap(swapped[1600], swapped[1601]);
  EXPECT_EQ(Refused(swapped), Range(1600, 1602));
}

// It jumps to where the axis is; then two steps must fit.
TEST(CountCheck, FrozenEncoder_IsRefusedUntilItMovesOnSmoothly) {
  auto counts = Swing(3000);
  for (int k = 1600; k < 2300; ++k) counts[k] = counts[1599];
  EXPECT_EQ(Refused(counts), Range(1600, 2303));
}

// Slower than the step that an acceleration could stop within a tick: what tells is that the axis was not slowing down.
TEST(CountCheck, FrozenEncoderOfASlowAxis_IsRefused) {
  std::vector<std::int32_t> counts;
  for (int k = 0; k < 3000; ++k) counts.push_back(60 * k);
  for (int k = 1600; k < 2300; ++k) counts[k] = counts[1599];
  EXPECT_EQ(Refused(counts), Range(1600, 2303));
}

TEST(CountCheck, EncoderThatIsOffForAWhile_IsRefusedUntilItIsBack) {
  auto counts = Swing(4000);
  for (int k = 1600; k < 2600; ++k) counts[k] += 1 << 14;
  EXPECT_EQ(Refused(counts), Range(1600, 2600));
}

// A new reference, not a fault: 2 s, and two steps that fit.
TEST(CountCheck, EncoderThatStaysWhereItJumpedTo_IsTakenAfterTwoSeconds) {
  auto counts = Swing(6000);
  for (int k = 1600; k < 6000; ++k) counts[k] += 1 << 20;
  const auto refused = Refused(counts);
  ASSERT_FALSE(refused.empty());
  EXPECT_EQ(refused.front(), 1600);
  EXPECT_NEAR(refused.back(), 3602, 2);
}

TEST(CountCheck, JumpOutOfStandstill_IsRefusedWhateverSideIsRight) {
  std::vector<std::int32_t> counts(3000, 12345);
  counts[1500] += 1 << 14;
  EXPECT_EQ(Refused(counts), Range(1500, 1504));
}

// An axis that comes to rest from a constant deceleration stops within the step that it has each tick.
TEST(CountCheck, StopAndStart_AreNotAFrozenEncoder) {
  std::vector<std::int32_t> counts;
  for (int k = 0; k < 6000; ++k) {
    const double t = k * 1e-3, stop = std::min(std::fmod(t, 2.0), 1.0);  // 1 rad/s^2 down to rest, then 1 s of rest
    counts.push_back(
        static_cast<std::int32_t>(std::lround((stop - stop * stop / 2 + 0.5 * std::floor(t / 2)) / kCount_rad)));
  }
  const auto refused = Refused(counts);
  EXPECT_LE(refused.size(), 60u);  // each start is a step of the speed, which no arm makes
  for (const int k : refused) EXPECT_LT(k % 2000, 20) << k;
}

// 40 rad/s^2 is beyond what an axis is taken for at first.
TEST(CountCheck, FastAxis_IsLearned) {
  std::vector<std::int32_t> counts;
  for (int k = 0; k < 20000; ++k)
    counts.push_back(static_cast<std::int32_t>(std::lround(0.1 * std::sin(20e-3 * k) / kCount_rad)));
  const auto refused = Refused(counts);
  EXPECT_LE(refused.size(), 40u);
  for (const int k : refused) EXPECT_LT(k, 1000);
}

// Noise of 200 counts, far beyond the limit of an encoder of whole counts: the mean difference widens the limit.
TEST(CountCheck, NoisyEncoder_IsNotLockedOut) {
  const auto refused = Refused(Swing(60000, 200));
  int late = 0;
  for (const int k : refused) late += k >= 30000;
  EXPECT_LE(late, 30);  // of 30000
}

std::vector<int> RefusedCurrents(const std::vector<int>& currents) {
  CurrentCheck check;
  std::vector<int> refused;
  for (std::size_t k = 0; k < currents.size(); ++k)
    if (!check.Check(static_cast<std::int16_t>(currents[k]), true)) refused.push_back(static_cast<int>(k));
  return refused;
}
std::vector<int> Currents(int ticks, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  std::vector<int> currents;
  for (int k = 0; k < ticks; ++k)
    currents.push_back(
        static_cast<int>(std::lround(3000 * std::sin(2e-3 * k) + (k % 1000 > 500 ? 800 : 0) + normal(random))));
  return currents;
}

// An axis that has shown a large acceleration may make larger steps. After minutes of slow motion it may not.
TEST(CountCheck, AFastMotion_IsForgottenAfterMinutes) {
  for (const int slow_ticks : {1000, 600000}) {
    std::vector<std::int32_t> counts;
    const auto add = [&](double q_rad) {
      counts.push_back(static_cast<std::int32_t>(std::lround(q_rad / kCount_rad)));
    };
    constexpr double kTurns = 31.4;                                                   // rad/s: 100 rad/s^2 at 0.1 rad
    const int fast = static_cast<int>(std::lround(20 * 3.14159265 / kTurns * 1000));  // ends where the axis rests
    for (int k = 0; k < fast; ++k) add(0.1 * std::cos(1e-3 * kTurns * k));
    for (int k = 0; k <= slow_ticks; ++k) add(0.1 + (1 - std::cos(3e-3 * k)) / 3);
    counts.back() += 300;
    const std::vector<int> refused = Refused(counts);  // also the first ticks, where the axis is not yet known
    EXPECT_EQ(refused.back() == static_cast<int>(counts.size()) - 1, slow_ticks > 1000) << slow_ticks;
  }
}

TEST(CurrentCheck, NoisyCurrentWithSteps_IsNotRefused) {
  EXPECT_TRUE(RefusedCurrents(Currents(20000, 50)).empty());
  EXPECT_TRUE(RefusedCurrents(Currents(20000, 1)).empty());
}

TEST(CurrentCheck, StuckSensor_IsRefusedFromTheEighthRepetitionOn) {
  auto currents = Currents(4000, 50);
  for (int k = 2000; k < 3000; ++k) currents[k] = currents[1999];
  EXPECT_EQ(RefusedCurrents(currents), Range(2007, 3000));
}

TEST(CurrentCheck, StandingAxisOrQuietSensor_MayRepeatItsCurrent) {
  CurrentCheck standing;
  for (int k = 0; k < 3000; ++k) {
    const bool moves = k < 1000;
    EXPECT_TRUE(standing.Check(static_cast<std::int16_t>(moves ? 100 + 37 * (k % 5) : 500), moves));
  }
  EXPECT_TRUE(RefusedCurrents(std::vector<int>(3000, 500)).empty());
}

// At the top of a slow swing a current without noise stays for many ticks.
TEST(CurrentCheck, SlowCurrentWithoutNoise_MayStandAtItsTop) {
  std::vector<int> currents;
  for (int k = 0; k < 20000; ++k) currents.push_back(static_cast<int>(std::lround(10000 * std::sin(1e-3 * k))));
  EXPECT_TRUE(RefusedCurrents(currents).empty());
}

TEST(CurrentCheck, EndOfTheRange_IsRefused) {
  auto currents = Currents(1000, 50);
  currents[500] = 32767;
  currents[600] = -32768;
  EXPECT_EQ(RefusedCurrents(currents), (std::vector<int>{500, 600}));
}

TEST(CurrentCheck, SensorThatJumpsAbout_IsRefused) {
  auto currents = Currents(4000, 50);
  std::mt19937 random(3);
  for (int k = 2000; k < 3000; ++k) currents[k] = static_cast<int>(random() % 20000) - 10000;
  const auto refused = RefusedCurrents(currents);
  ASSERT_GT(refused.size(), 700u);  // of 1000: what is usual grows meanwhile
  EXPECT_GE(refused.front(), 2002);
  EXPECT_LE(refused.front(), 2010);
  EXPECT_LE(refused.back(), 3020);
}

// What the checks refuse acts as the flags do, and is counted once a tick.
TEST(SignalPath, ImplausibleCount_IsStale_ImplausibleCurrent_SpoilsItsAxis) {
  const Axes<2> axes = {{4e-7f, 4e-7f}, {0, 0}, {0.1f, 0.1f}, {1, 0, 0, 1}, {1, 0, 0, 1}, 1000.0f};
  const auto counts = Swing(2000);
  SignalPath<2, 8> path(axes);
  path.SetSettings({{0.01f, 0.01f}, {1.0f, 1.0f}, 1u});
  int without_count = 0, without_current = 0, good = 0;
  for (std::uint32_t tick = 0; tick < 2000; ++tick) {
    model::RawSample<2> raw;
    raw.tick = tick;
    for (int i = 0; i < 2; ++i) raw.counts[i] = counts[tick], raw.current[i] = 100, raw.flags[i] = model::kEnabled;
    if (tick == 1000) raw.counts[1] ^= 1 << 16;
    if (tick == 1500) raw.current[0] = 32767;
    if (!path.PushTick(raw)) continue;
    const bool first = (path.sample().flags[0] & model::kValid) != 0,
               second = (path.sample().flags[1] & model::kValid) != 0;
    without_count += !first && !second;
    without_current += !first && second;
    good += first && second;
  }
  EXPECT_EQ(without_count, 5);
  EXPECT_EQ(without_current, 5);
  EXPECT_EQ(good, 250 - 4 - 10);
  EXPECT_EQ(path.implausible_count(), 2u);
}

}  // namespace
}  // namespace armcal::signal
