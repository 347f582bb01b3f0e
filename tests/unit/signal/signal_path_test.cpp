// signal - the signal path against analytic motion.
#include "armcal/signal/signal_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace armcal::signal {
namespace {

constexpr int kTicks = 8;
constexpr double kStep_rad = 2 * M_PI / (131072.0 * 100.0);  // 17-bit encoder, gear of 100
using Raw = model::RawSample<2>;
using Path = SignalPath<2, kTicks>;

Axes<2> Plain() {
  Axes<2> a = {{static_cast<float>(kStep_rad), static_cast<float>(-kStep_rad)},
               {0, 1000},
               {0.1f, -0.05f},
               {1, 0, 0, 1},
               {1, 0, 0, 1},
               1000.0f};
  return a;
}
Settings<2> Table() { return {{0.01f, 0.01f}, {1.0f, 1.0f}, 1u}; }

// Motion of both motor axes (joint units) as time goes; counts rounded to nearest.
struct Drive {
  std::function<double(double)> motion[2];
  std::int32_t offset[2] = {0, 1000};
  Raw At(std::uint32_t tick) const {
    Raw raw;
    raw.tick = tick;
    for (int i = 0; i < 2; ++i) {
      const double counts = std::round(motion[i](tick * 1e-3) / (i == 0 ? kStep_rad : -kStep_rad));
      raw.counts[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(counts)) +
                                                static_cast<std::uint32_t>(offset[i]));
      raw.current[i] = static_cast<std::int16_t>(100 * (i + 1));
      raw.flags[i] = model::kEnabled;
      raw.temperature_degC[i] = 30.0f + static_cast<float>(i);
    }
    return raw;
  }
};
Drive Sines() {
  return {{[](double t) { return 0.8 * std::sin(2 * M_PI * 0.7 * t); },
           [](double t) { return 1.5 - 0.3 * std::cos(2 * M_PI * 1.3 * t); }}};
}

// Box average over the window's ticks of A sin(w t + p), and its derivatives: factor sinc-like, at the centre.
double BoxGain(double w) { return std::sin(w * kTicks * 0.5e-3) / (kTicks * std::sin(w * 0.5e-3)); }

TEST(SignalPath, SineMotion_GivesAnalyticMotionOfTheWindowCentre) {
  Path path(Plain());
  path.SetSettings(Table());
  const Drive drive = Sines();
  double worst_q = 0, worst_qd = 0, worst_qdd = 0;
  int samples = 0;
  for (std::uint32_t tick = 0; tick < 4000; ++tick) {
    if (!path.PushTick(drive.At(tick))) continue;
    ++samples;
    const model::Sample<2>& s = path.sample();
    EXPECT_EQ(s.tick, tick - 3 * kTicks + 1);  // first tick of the third of five windows
    const double t = (s.tick + 0.5 * (kTicks - 1)) * 1e-3;
    const double w = 2 * M_PI * 0.7, a = 0.8 * BoxGain(w);
    worst_q = std::max(worst_q, std::abs(s.q[0] - a * std::sin(w * t)));
    worst_qd = std::max(worst_qd, std::abs(s.qd[0] - a * w * std::cos(w * t)));
    worst_qdd = std::max(worst_qdd, std::abs(s.qdd[0] + a * w * w * std::sin(w * t)));
    EXPECT_FLOAT_EQ(s.tau[0], 10.0f);
    EXPECT_FLOAT_EQ(s.tau[1], -10.0f);
    EXPECT_FLOAT_EQ(s.temperature_degC[1], 31.0f);
  }
  EXPECT_EQ(samples, 4000 / kTicks - 4);
  // Step of 4.8e-7 rad, eight averaged: 5e-8 rad rms. Speed: 1.4 / 8 ms of it; acceleration: 4 / (8 ms)^2 of it.
  EXPECT_LT(worst_q, 3e-7);
  EXPECT_LT(worst_qd, 6e-5);
  EXPECT_LT(worst_qdd, 2e-2);
}

TEST(SignalPath, SpeedAndAccelerationFormulas_AreOfFourthOrder) {
  // Quartic in time in exact integer counts: the five-point formulas are exact for it up to float rounding.
  Axes<2> axes = Plain();
  axes.counts_to_rad[0] = 1.0f;
  SignalPath<2, 1> path(axes);
  path.SetSettings(Table());
  const auto x = [](std::int64_t t) { return static_cast<std::int32_t>(t * t * t * t - 3 * t * t * t + 2 * t); };
  for (std::uint32_t tick = 0; tick < 30; ++tick) {
    Raw raw;
    raw.tick = tick;
    raw.counts[0] = x(tick);
    if (!path.PushTick(raw)) continue;
    const double t = path.sample().tick;
    EXPECT_FLOAT_EQ(path.sample().q[0], static_cast<float>(x(static_cast<int>(t))));
    EXPECT_NEAR(path.sample().qd[0] / 1e3, 4 * t * t * t - 9 * t * t + 2, 1e-6 * (1 + t * t * t));
    EXPECT_NEAR(path.sample().qdd[0] / 1e6, 12 * t * t - 18 * t, 1e-6 * (1 + t * t * t));
  }
}

TEST(SignalPath, CountsThatWrapAtTwoToThe31_GiveTheSameMotion) {
  Axes<2> axes = Plain();
  Drive plain = Sines(), wrapped = Sines();
  axes.zero_counts[0] = std::numeric_limits<std::int32_t>::max() - 1000;
  wrapped.offset[0] = axes.zero_counts[0];
  Path a(Plain()), b(axes);
  a.SetSettings(Table());
  b.SetSettings(Table());
  for (std::uint32_t tick = 0; tick < 1500; ++tick)
    if (a.PushTick(plain.At(tick)) & b.PushTick(wrapped.At(tick))) {
      EXPECT_EQ(a.sample().q[0], b.sample().q[0]);
      EXPECT_EQ(a.sample().qd[0], b.sample().qd[0]);
      EXPECT_EQ(a.sample().qdd[0], b.sample().qdd[0]);
    }
}

// The sum over a window wraps. That is defined, and the sanitizers watch it; later windows are not touched.
TEST(SignalPath, CountsThatJumpThroughTheirWholeRange_LeaveTheNextSamplesAsTheyAre) {
  Path with(Plain()), without(Plain());
  with.SetSettings(Table()), without.SetSettings(Table());
  const Drive drive = Sines();
  for (std::uint32_t tick = 0; tick < 400; ++tick) {
    Raw raw = drive.At(tick);
    const bool ready = without.PushTick(raw);
    if (tick >= 100 && tick < 110)
      raw.counts[0] ^= static_cast<std::int32_t>(tick % 2 == 0 ? 0x80000000u : 0x60000000u);
    ASSERT_EQ(with.PushTick(raw), ready);
    if (!ready || tick < 160) continue;
    EXPECT_EQ(with.sample().q[0], without.sample().q[0]);
    EXPECT_EQ(with.sample().qdd[0], without.sample().qdd[0]);
  }
}

TEST(SignalPath, TickCounterThatWraps_IsNoGap) {
  Path path(Plain());
  const Drive drive = Sines();
  int samples = 0;
  for (std::uint32_t i = 0; i < 160; ++i) {
    Raw raw = drive.At(i);
    raw.tick = 0u - 80u + i;
    samples += path.PushTick(raw);
  }
  EXPECT_EQ(samples, 160 / kTicks - 4);
  EXPECT_EQ(path.gap_count(), 0u);
}

TEST(SignalPath, MissedTick_RestartsTheHistoryOnTheNextWindowBoundary) {
  Path path(Plain());
  const Drive drive = Sines();
  std::uint32_t first_after = 0;
  for (std::uint32_t tick = 0; tick < 300; ++tick) {
    if (tick == 101) continue;
    if (path.PushTick(drive.At(tick)) && tick > 101 && first_after == 0) first_after = path.sample().tick;
  }
  EXPECT_EQ(path.gap_count(), 1u);
  EXPECT_EQ(first_after, 104u + 2 * kTicks);
}

TEST(SignalPath, SaturatedTick_SpoilsThatAxisForFiveSamples_StaleSpoilsAll) {
  for (const std::uint8_t flag : {model::kSaturated, model::kStale}) {
    Path path(Plain());
    path.SetSettings(Table());
    const Drive drive = Sines();
    int invalid[2] = {};
    for (std::uint32_t tick = 0; tick < 400; ++tick) {
      Raw raw = drive.At(tick);
      if (tick == 203) raw.flags[1] |= flag;
      if (!path.PushTick(raw)) continue;
      for (int i = 0; i < 2; ++i) invalid[i] += (path.sample().flags[i] & model::kValid) == 0;
    }
    EXPECT_EQ(invalid[1], 5);
    EXPECT_EQ(invalid[0], flag == model::kStale ? 5 : 0);
  }
}

TEST(SignalPath, DisabledAxis_IsNotValid) {
  Path path(Plain());
  const Drive drive = Sines();
  for (std::uint32_t tick = 0; tick < 64; ++tick) {
    Raw raw = drive.At(tick);
    raw.flags[0] = 0;
    if (path.PushTick(raw)) {
      EXPECT_EQ(path.sample().flags[0] & model::kValid, 0);
    }
  }
  EXPECT_NE(path.sample().flags[1] & model::kValid, 0);
}

TEST(SignalPath, Moving_NeedsSpeedAboveVMinAndOneSignOverTheSpan) {
  Path path(Plain());
  path.SetSettings(Table());
  Drive drive = Sines();
  drive.motion[1] = [](double t) { return 0.005 * t; };  // below v_min
  for (std::uint32_t tick = 0; tick < 4000; ++tick) {
    if (!path.PushTick(drive.At(tick))) continue;
    const double w = 2 * M_PI * 0.7, centre = (path.sample().tick + 3.5) * 1e-3;
    const auto speed = [&](double t) { return 0.8 * w * std::cos(w * t); };
    // The outer steps between averages are centred 12 ms from the middle and reach over 20 ms.
    const bool one_sign = speed(centre - 0.020) * speed(centre + 0.020) > 0;
    const bool turns = speed(centre - 0.011) * speed(centre + 0.011) < 0;
    const bool moving = (path.sample().flags[0] & model::kMoving) != 0;
    EXPECT_FALSE(moving && turns) << centre;
    EXPECT_TRUE(moving || !one_sign || std::abs(speed(centre)) < 0.05) << centre;
    EXPECT_EQ(path.sample().flags[1] & model::kMoving, 0);
  }
}

TEST(SignalPath, CoupledAxes_GiveJointMotionAndTorque_AndShareValidity) {
  Axes<2> axes = Plain();
  const float a[4] = {1, 0, 0.5f, 1}, b[4] = {1, -0.5f, 0, 1};
  std::copy(a, a + 4, axes.motor_to_joint);
  std::copy(b, b + 4, axes.motor_torque_to_joint);
  Path coupled(axes), plain(Plain());
  Settings<2> table = Table();
  table.torque_scale[0] = 2.0f;
  coupled.SetSettings(table);
  plain.SetSettings(Table());
  const Drive drive = Sines();
  for (std::uint32_t tick = 0; tick < 400; ++tick) {
    Raw raw = drive.At(tick);
    if (tick >= 300) raw.flags[0] |= model::kSaturated;
    if (!(coupled.PushTick(raw) & plain.PushTick(raw))) continue;
    const model::Sample<2>&c = coupled.sample(), &p = plain.sample();
    EXPECT_FLOAT_EQ(c.q[1], 0.5f * p.q[0] + p.q[1]);
    EXPECT_FLOAT_EQ(c.qd[1], 0.5f * p.qd[0] + p.qd[1]);
    EXPECT_FLOAT_EQ(c.qdd[1], 0.5f * p.qdd[0] + p.qdd[1]);
    EXPECT_FLOAT_EQ(c.tau[0], 2.0f * (p.tau[0] - 0.5f * p.tau[1]));
    EXPECT_FLOAT_EQ(c.tau[1], p.tau[1]);
    EXPECT_TRUE(tick < 350 || (c.flags[1] & model::kValid) == 0);
  }
}

}  // namespace
}  // namespace armcal::signal
