// tests - the signal path on raw ticks with gaps, wrapping counts, stale and saturated axes, time stamps and a
// coupling.
#include "armcal/signal/signal_path.hpp"
#include "port/runner/line.hpp"
#include "tests/target/raw_ticks.hpp"

using namespace armcal;          // NOLINT: all of it is under test
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

constexpr int n = 6;
using Path = signal::SignalPath<n, 8>;

// Coupled wrist, as in arms whose last motors sit before the elbow.
signal::Axes<n> CoupledAxes() {
  signal::Axes<n> axes = {};
  for (int i = 0; i < n; ++i) {
    axes.counts_to_rad[i] = (i % 2 == 0 ? 1.0f : -1.0f) * (3.9e-7f + 1e-7f * static_cast<float>(i));
    axes.zero_counts[i] = 40960 * i;
    axes.lsb_to_Nm[i] = 0.2f / static_cast<float>(1 + i);
    axes.motor_to_joint[i * n + i] = axes.motor_torque_to_joint[i * n + i] = 1.0f;
  }
  axes.motor_to_joint[5 * n + 4] = 0.37f;
  axes.motor_torque_to_joint[4 * n + 5] = -0.37f;
  axes.tick_rate_Hz = 1000.0f;
  return axes;
}

}  // namespace

int Program() {
  static Path path(CoupledAxes());
  signal::Settings<n> settings = {};
  for (int i = 0; i < n; ++i) {
    settings.v_min_radps[i] = 0.01f;
    settings.torque_scale[i] = 1.0f + 0.01f * static_cast<float>(i);
  }
  path.SetSettings(settings);
  RawTicks<n> ticks;
  Numbers jitter(5);
  Digest digest;
  int samples = 0;
  for (int k = 1; k <= 64000; ++k) {
    model::RawSample<n> raw = ticks.Next();
    raw.stamped = k > 32000;  // by up to 50 us early or late; a few frames are repeated
    raw.latch_ns = (raw.tick - (jitter.Below(1000) == 0 ? 1u : 0u)) * 1000000u +
                   static_cast<std::uint32_t>(jitter.Below(100001) - 50000);
    if (path.PushTick(raw)) {
      ++samples;
      const model::Sample<n>& s = path.sample();
      digest.Add(s.tick);
      for (const float* values : {s.q, s.qd, s.qdd, s.tau, s.temperature_degC}) digest.Add(values, n);
      for (const std::uint8_t flags : s.flags) digest.Add(std::uint32_t{flags});
    }
    if (k % 1000 == 0) Line("tick").Decimal(k).Hex(digest.value()).End();
  }
  Line("samples").Decimal(samples).Decimal(path.gap_count()).End();
  return 0;
}
