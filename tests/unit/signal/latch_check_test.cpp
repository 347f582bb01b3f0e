// signal - time stamps of the encoders' latch: which frames are refused, and what the stamps are worth in a sample.
#include "armcal/signal/latch_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "armcal/signal/signal_path.hpp"

namespace armcal::signal {
namespace {

constexpr std::uint32_t kPeriod_ns = 1000000, kStart_ns = 0u - 5u * kPeriod_ns;  // wraps in the fifth tick

std::vector<std::uint32_t> Even(int ticks) {
  std::vector<std::uint32_t> stamps;
  for (int k = 0; k < ticks; ++k) stamps.push_back(kStart_ns + kPeriod_ns * static_cast<std::uint32_t>(k));
  return stamps;
}
std::vector<int> RefusedFrames(const std::vector<std::uint32_t>& stamps) {
  LatchCheck check;
  check.Start(1000.0f);
  std::vector<int> refused;
  for (std::size_t k = 0; k < stamps.size(); ++k)
    if (!check.Check(true, stamps[k])) refused.push_back(static_cast<int>(k));
  return refused;
}

TEST(LatchCheck, JitteredStamps_FitAndSayHowLateTheyAre) {
  LatchCheck check;
  check.Start(1000.0f);
  std::mt19937 random(3);
  std::int32_t before = 0, first = 0;
  for (std::uint32_t k = 0; k < 10000; ++k) {
    const auto off = static_cast<std::int32_t>(random() % 400001) - 200000;  // a fifth of the period to each side
    EXPECT_TRUE(check.Check(true, kStart_ns + kPeriod_ns * k + static_cast<std::uint32_t>(off)));
    if (k == 0) first = off;
    const std::int32_t late = k == 0 ? 0 : off - before;
    EXPECT_EQ(static_cast<std::int32_t>(check.off_ns()), off - first);
    EXPECT_NEAR(check.late(1 << 20), late * 1e-6 * (1 << 20), 1.0);
    before = off;
  }
}

TEST(LatchCheck, RepeatedFrame_IsRefusedAlone_WhetherTheNextOneIsMissingOrLate) {
  auto missing = Even(100), late = missing;
  missing[50] = missing[49];
  EXPECT_EQ(RefusedFrames(missing), std::vector<int>({50}));
  auto slow = Even(100);
  for (int k = 0; k < 100; ++k) slow[k] += static_cast<std::uint32_t>(k) * 4000u;  // a clock that is 0.4 % fast
  slow[50] = slow[49];
  EXPECT_EQ(RefusedFrames(slow), std::vector<int>({50}));
  for (int k = 50; k < 100; ++k) late[k] -= kPeriod_ns;  // from here on, frames come a tick later
  EXPECT_EQ(RefusedFrames(late), std::vector<int>({50, 51, 52, 53, 54, 55, 56, 57}));
}

TEST(LatchCheck, SwappedFramesAndAFlippedBit_AreRefused) {
  auto swapped = Even(100), flipped = swapped;
  std::swap(swapped[50], swapped[51]);
  EXPECT_EQ(RefusedFrames(swapped), std::vector<int>({50, 51}));
  flipped[50] ^= 1u << 24;
  EXPECT_EQ(RefusedFrames(flipped), std::vector<int>({50}));
}

TEST(LatchCheck, ClockThatIsSet_IsFollowed_OneThatStandsStillIsNot) {
  auto set = Even(200), still = set;
  for (int k = 50; k < 200; ++k) set[k] += 123456789u, still[k] = still[49];
  EXPECT_EQ(RefusedFrames(set).size(), static_cast<std::size_t>(LatchCheck::kPatience));
  EXPECT_EQ(RefusedFrames(set).back(), 49 + LatchCheck::kPatience);
  EXPECT_EQ(RefusedFrames(still).size(), 150u);
}

TEST(LatchCheck, TicksWithoutStamps_FitAndAreNeverLate_OneAmongOthersIsRefused) {
  LatchCheck without, among;
  without.Start(1000.0f), among.Start(1000.0f);
  std::mt19937 random(3);
  int refused = 0;
  for (std::uint32_t k = 0; k < 100; ++k) {
    EXPECT_TRUE(without.Check(false, static_cast<std::uint32_t>(random())));
    EXPECT_EQ(without.late(1 << 20), 0);
    EXPECT_EQ(without.off_ns(), 0u);
    const bool good = among.Check(k != 50, kStart_ns + kPeriod_ns * k);
    EXPECT_EQ(good, k != 50);
    refused += !good;
  }
  EXPECT_EQ(refused, 1);
}

// The motion of the analytic test in signal_path_test.cpp, one axis, whose ticks come early or late by 20 us rms.
constexpr double kLsb_rad = 2 * M_PI / (131072.0 * 100.0), kW_radps = 2 * M_PI * 0.7;
struct Worst {
  double q = 0, qd = 0, qdd = 0;
};
// stamped = false: the ticks do not tell. The truth is that of the mean instant of the centre window.
Worst WorstErrors(bool stamped, double drift) {
  SignalPath<1, 8> path({{static_cast<float>(kLsb_rad)}, {0}, {0.1f}, {1}, {1}, 1000.0f});
  path.SetSettings({{0.01f}, {1.0f}, 1u});
  std::mt19937 random(11);
  std::normal_distribution<double> jitter(0, 20e-6);
  std::vector<double> at_s;
  Worst worst;
  int samples = 0;
  for (std::uint32_t tick = 0; tick < 4000; ++tick) {
    at_s.push_back(1e-3 * tick * (1 + drift) + jitter(random));
    model::RawSample<1> raw;
    raw.tick = tick;
    raw.counts[0] = static_cast<std::int32_t>(std::lround(0.8 * std::sin(kW_radps * at_s.back()) / kLsb_rad));
    raw.flags[0] = model::kEnabled;
    raw.stamped = stamped;
    raw.latch_ns = kStart_ns + static_cast<std::uint32_t>(std::llround(1e9 * at_s.back()));
    if (!path.PushTick(raw)) continue;
    const model::Sample<1>& s = path.sample();
    double t = 0;
    for (std::uint32_t k = 0; k < 8; ++k) t += at_s[s.tick + k] / 8;
    const double box = std::sin(kW_radps * 4e-3) / (8 * std::sin(kW_radps * 0.5e-3)), a = 0.8 * box;
    worst.q = std::max(worst.q, std::abs(s.q[0] - a * std::sin(kW_radps * t)));
    worst.qd = std::max(worst.qd, std::abs(s.qd[0] - a * kW_radps * std::cos(kW_radps * t)));
    worst.qdd = std::max(worst.qdd, std::abs(s.qdd[0] + a * kW_radps * kW_radps * std::sin(kW_radps * t)));
    samples += (s.flags[0] & model::kValid) != 0;
  }
  if (stamped) {
    EXPECT_EQ(samples, 4000 / 8 - 4);
  }
  return worst;
}
TEST(Latch, JitteredSine_HasTheAccuracyOfExactTicks) {
  for (const double drift : {0.0, 1e-4, -1e-2}) {
    const Worst stamped = WorstErrors(true, drift);
    EXPECT_LT(stamped.q, 3e-7) << drift;  // the limits of exact ticks
    EXPECT_LT(stamped.qd, 6e-5) << drift;
    EXPECT_LT(stamped.qdd, 2e-2) << drift;
  }
  const Worst bare = WorstErrors(false, 0);
  EXPECT_GT(bare.qd, 1e-3);  // else the stamps would be worth nothing
  EXPECT_GT(bare.qdd, 0.5);
}

// At rest a repeated frame has the right counts. Only the stamp tells that nothing was measured.
TEST(Latch, RepeatedFrameOfAnArmAtRest_SpoilsFiveSamples) {
  for (const bool stamped : {false, true}) {
    SignalPath<1, 8> path({{static_cast<float>(kLsb_rad)}, {0}, {0.1f}, {1}, {1}, 1000.0f});
    int invalid = 0;
    for (std::uint32_t tick = 0; tick < 400; ++tick) {
      model::RawSample<1> raw;
      raw.tick = tick;
      raw.counts[0] = 4711;
      raw.flags[0] = model::kEnabled;
      raw.stamped = stamped;
      raw.latch_ns = kPeriod_ns * (tick == 203 ? 202 : tick);
      if (path.PushTick(raw)) invalid += (path.sample().flags[0] & model::kValid) == 0;
    }
    EXPECT_EQ(invalid, stamped ? 5 : 0);
    EXPECT_EQ(path.implausible_count(), stamped ? 1u : 0u);
  }
}

// The tick is long, so sums of wrong stamps wrap. That is defined, and the sanitizers watch it; all numbers are finite,
// and later samples have the motion of exact ticks again.
TEST(Latch, GarbledStamps_AreRefusedAndForgotten) {
  const Axes<1> slow = {{static_cast<float>(kLsb_rad)}, {0}, {0.1f}, {1}, {1}, 100.0f};
  SignalPath<1, 8> with(slow), without(slow);
  std::mt19937 random(13);
  int compared = 0;
  for (std::uint32_t tick = 0; tick < 800; ++tick) {
    model::RawSample<1> raw;
    raw.tick = tick;
    raw.counts[0] = static_cast<std::int32_t>(std::lround(0.8 * std::sin(0.02 * tick) / kLsb_rad));
    raw.flags[0] = model::kEnabled;
    const bool ready = without.PushTick(raw);
    raw.stamped = true;
    raw.latch_ns = 10 * kPeriod_ns * tick;
    if (tick >= 200 && tick < 260) raw.latch_ns = static_cast<std::uint32_t>(random());
    ASSERT_EQ(with.PushTick(raw), ready);
    if (!ready) continue;
    const model::Sample<1>&s = with.sample(), &exact = without.sample();
    EXPECT_TRUE(std::isfinite(s.q[0]) && std::isfinite(s.qd[0]) && std::isfinite(s.qdd[0])) << tick;
    EXPECT_FALSE(tick >= 207 && tick < 295 && (s.flags[0] & model::kValid) != 0) << tick;
    if (tick >= 200 && tick < 320) continue;
    EXPECT_NEAR(s.q[0], exact.q[0], 1e-6) << tick;
    EXPECT_NEAR(s.qd[0], exact.qd[0], 1e-6) << tick;
    ++compared;
  }
  EXPECT_GT(compared, 70);
}

// An axis whose frames come 0.3 periods early or late makes steps that no arm makes; with the stamps they fit. A frame
// that is repeated keeps its axis in step, so the tick after it is not refused.
TEST(CountCheck, StepsOfLateFrames_AreComparedByTheirTime) {
  for (const bool told : {false, true}) {
    CountCheck check;
    check.Start(static_cast<float>(kLsb_rad), 1000.0f);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> jitter(-0.3, 0.3);
    double before = 0;
    std::vector<int> refused;
    std::int32_t counts = 0;
    for (int k = 0; k < 3000; ++k) {
      const double off = k == 0 ? 0 : jitter(random);
      const bool repeated = k == 2000;
      const double late = repeated ? -1 : k == 2001 ? off - before + 1 : off - before;
      if (!repeated) {
        counts = static_cast<std::int32_t>(std::lround(std::sin(3e-3 * (k + off) + 0.4) / 3 / kLsb_rad));
        before = off;
      }
      if (!check.Check(counts, told ? static_cast<std::int32_t>(std::lround(late * CountCheck::kLate)) : 0))
        refused.push_back(k);
    }
    if (told) EXPECT_EQ(refused, std::vector<int>());
    else EXPECT_GT(refused.size(), 100u);
  }
}

}  // namespace
}  // namespace armcal::signal
