// signal - everything in a sample belongs to the same ticks and the same settings.
#include <gtest/gtest.h>

#include "armcal/signal/signal_path.hpp"

namespace armcal::signal {
namespace {

constexpr int kWindow = 8;  // ticks of a sample
using OneAxisPath = SignalPath<1, kWindow>;

const Axes<1> kAxes = {{1.0f}, {0}, {1.0f}, {1}, {1}, 1000.0f};

// Counts, current and temperature all rise by one a tick.
model::RawSample<1> Ramp(std::uint32_t tick) {
  model::RawSample<1> raw;
  raw.tick = tick;
  raw.counts[0] = static_cast<std::int32_t>(tick);
  raw.current[0] = static_cast<std::int16_t>(tick);
  raw.flags[0] = model::kEnabled;
  raw.temperature_degC[0] = static_cast<float>(tick);
  return raw;
}

TEST(OneInstant, TorqueAndTemperature_AreAveragedOverTheTicksOfThePosition) {
  OneAxisPath path(kAxes);
  int samples = 0;
  for (std::uint32_t tick = 0; tick < 400; ++tick) {
    if (!path.PushTick(Ramp(tick))) continue;
    ++samples;
    const model::Sample<1>& s = path.sample();
    const float mean = static_cast<float>(s.tick) + 3.5f;  // of eight ticks from the first on
    EXPECT_EQ(s.q[0], mean);
    EXPECT_EQ(s.tau[0], mean);
    EXPECT_EQ(s.temperature_degC[0], mean);
  }
  EXPECT_EQ(samples, 400 / kWindow - 4);
}

TEST(OneInstant, NewSettings_StartANewHistory) {
  OneAxisPath path(kAxes);
  for (std::uint32_t tick = 0; tick < 100; ++tick) static_cast<void>(path.PushTick(Ramp(tick)));
  path.SetSettings({{0.01f}, {2.0f}, 7u});
  std::uint32_t first = 0;
  for (std::uint32_t tick = 100; tick < 200 && first == 0; ++tick)
    if (path.PushTick(Ramp(tick))) first = path.sample().tick;
  // The next window begins at 104; the first sample is the third of five windows from there.
  EXPECT_EQ(first, 104u + 2 * kWindow);
  EXPECT_EQ(path.sample().tau[0], 2.0f * (static_cast<float>(first) + 3.5f));
  EXPECT_EQ(path.generation(), 7u);
}

}  // namespace
}  // namespace armcal::signal
