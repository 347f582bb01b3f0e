// estimator - runs with wrong readings that no bus has flagged, and the runs that they are compared with; the tests'
// bench.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/estimator/moving_arm.hpp"

namespace armcal::estimator::test {

using Model = generated::Er20Like;
using Ticks = std::vector<model::RawSample<6>>;

// Ticks of an arm that moves: counts rounded, currents with the noise that makes a sample's sigma. Each tick comes
// early or late by jitter_us (rms), and the ticks' clock is wrong by `drift`. The time stamps are right.
inline Ticks MakeTicks(double jitter_us, bool stamped, double drift = 0) {
  Ticks made(20000);
  MovingArm<Model> arm;
  std::mt19937 random(9), early(5);
  std::normal_distribution<double> normal, jitter;
  for (std::size_t k = 0; k < made.size(); ++k) {
    const double now_s = static_cast<double>(k) / Model::kTickRate_Hz * (1 + drift) + 1e-6 * jitter_us * jitter(early);
    for (double& clock : arm.clock_s) clock = now_s;  // Next() steps by a sample
    const auto now = arm.Next();
    model::Sample<6> quiet = now;
    const Vector tau = Regressor<Model>(quiet) * arm.truth;
    auto& raw = made[k];
    raw.tick = static_cast<std::uint32_t>(k);
    raw.stamped = stamped;
    raw.latch_ns = static_cast<std::uint32_t>(4'000'000'000 + std::llround(1e9 * now_s));  // wraps in the first second
    for (int i = 0; i < 6; ++i) {
      const model::AxisInfo& axis = Model::kAxes[i];
      raw.counts[i] = axis.zero_counts + static_cast<std::int32_t>(std::lround(now.q[i] / axis.counts_to_rad));
      const double noise = std::sqrt(8.0) * axis.sigma_Nm * normal(random);
      raw.current[i] = static_cast<std::int16_t>(std::lround((tau(i) + noise) / axis.lsb_to_Nm));
      raw.flags[i] = model::kEnabled;
      raw.temperature_degC[i] = 30.0f;
    }
  }
  return made;
}
inline const Ticks& CleanTicks() {
  static const Ticks ticks = MakeTicks(0, false);
  return ticks;
}
inline const Ticks& JitteredTicks() {
  static const Ticks ticks = MakeTicks(20, true);
  return ticks;
}

inline constexpr std::uint32_t kLost = ~0u;  // in the place of a tick's number: the drive never sees it

// bad: what the drive sees. known: the same ticks, exactly in time, clean and flagged by the bus.
struct Pair {
  Ticks bad, known = CleanTicks();
  std::mt19937 random;
  Pair(unsigned seed, const Ticks& seen) : bad(seen), random(seed) {}
  void Flag(int k, int i, std::uint8_t flag = model::kStale) { known[k].flags[i] |= flag; }
  int Axis() { return static_cast<int>(random() % 6); }
  // Calls each(tick) once a second at a random tick.
  template <class Each>
  void EverySecond(Each each) {
    for (int k = 0; k + 1010 < static_cast<int>(bad.size()); k += 1000) each(k + 5 + static_cast<int>(random() % 1000));
  }
  // Calls each(reading of the tick, reading at the start, axis) for a second of each axis in turn.
  template <class Each>
  void ForASecond(std::uint8_t flag, Each each) {
    for (int i = 0; i < 6; ++i) {
      const int start = 2500 + 2800 * i + static_cast<int>(random() % 500);
      for (int k = start; k < start + 1000; ++k) each(bad[k], bad[start], i), Flag(k, i, flag);
    }
  }
};

struct Glitch {
  const char* name;
  std::function<void(Pair&)> plant;
};
inline const std::vector<Glitch>& Battery() {
  static const std::vector<Glitch> battery = {
      {"a flipped bit",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           const int i = p.Axis();
           p.bad[k].counts[i] =
               static_cast<std::int32_t>(static_cast<std::uint32_t>(p.bad[k].counts[i]) ^ (1u << p.random() % 32));
           p.Flag(k, i);
         });
       }},
      {"full current",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           const int i = p.Axis(), ticks = 1 + static_cast<int>(p.random() % 3);
           for (int t = k; t < k + ticks; ++t)
             p.bad[t].current[i] = p.random() % 2 ? 32767 : -32768, p.Flag(t, i, model::kSaturated);
         });
       }},
      {"a large current",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           const int i = p.Axis(), ticks = 1 + static_cast<int>(p.random() % 3);
           for (int t = k; t < k + ticks; ++t) p.bad[t].current[i] = 25000, p.Flag(t, i, model::kSaturated);
         });
       }},
      {"a repeated frame",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           const auto tick = p.bad[k].tick;
           p.bad[k] = p.bad[k - 1];
           p.bad[k].tick = tick;
           p.Flag(k, 0);
         });
       }},
      {"lost frames",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           const int ticks = 1 + static_cast<int>(p.random() % 3);
           for (int t = k; t < k + ticks; ++t) p.bad[t].tick = kLost, p.Flag(t, 0);
         });
       }},
      {"swapped frames",
       [](Pair& p) {
         p.EverySecond([&](int k) {
           std::swap(p.bad[k], p.bad[k + 1]);
           std::swap(p.bad[k].tick, p.bad[k + 1].tick);
           p.Flag(k, 0), p.Flag(k + 1, 0);
         });
       }},
      {"a frozen encoder",
       [](Pair& p) {
         p.ForASecond(model::kStale, [](auto& now, const auto& start, int i) { now.counts[i] = start.counts[i]; });
       }},
      {"an encoder at zero",
       [](Pair& p) { p.ForASecond(model::kStale, [](auto& now, const auto&, int i) { now.counts[i] = 0; }); }},
      {"an encoder that is off",
       [](Pair& p) { p.ForASecond(model::kStale, [](auto& now, const auto&, int i) { now.counts[i] += 1 << 14; }); }},
      {"an encoder that jumps",
       [](Pair& p) {
         p.ForASecond(model::kStale, [&](auto& now, const auto&, int i) {
           now.counts[i] += static_cast<int>(p.random() % (1 << 18));
         });
       }},
      {"a stuck current",
       [](Pair& p) {
         p.ForASecond(model::kSaturated,
                      [](auto& now, const auto& start, int i) { now.current[i] = start.current[i]; });
       }},
      {"a current that jumps",
       [](Pair& p) {
         p.ForASecond(model::kSaturated, [&](auto& now, const auto&, int i) {
           now.current[i] = static_cast<std::int16_t>(static_cast<int>(p.random() % 20000) - 10000);
         });
       }},
  };
  return battery;
}

template <class Filter>
struct GlitchTest : testing::Test {
  using Arm = Estimator<Model, Filter>;
  std::unique_ptr<physical::RigidPrior<Model, float>> rigid = std::make_unique<physical::RigidPrior<Model, float>>();
  std::unique_ptr<AdoptedTable<Model>> table = std::make_unique<AdoptedTable<Model>>();
  std::unique_ptr<Arm> arm;

  GlitchTest() {
    const auto built = BuildAdoptedTable<Model>(DefaultTable<Model>(), 1, *rigid, *table);
    EXPECT_EQ(built, core::Status::kOk);
  }
  // What is published along the ticks.
  std::vector<Estimates<Model>> Run(const Ticks& ticks) {
    arm = std::make_unique<Arm>();
    arm->Adopt(*table, 0);
    std::vector<Estimates<Model>> published(1);
    for (const auto& raw : ticks) {
      if (raw.tick != kLost) (void)arm->Push(raw);
      while (arm->Step()) {
      }
      if (arm->Take(published.back())) published.push_back(published.back());
    }
    published.pop_back();
    return published;
  }
  // What the drive publishes must stay within one standard deviation of what it publishes along the known ticks.
  void Compare(const char* name, const Pair& pair) {
    const auto known = Run(pair.known), bad = Run(pair.bad);  // the last one is `arm`'s
    ASSERT_EQ(bad.size(), known.size()) << name;
    ASSERT_GT(bad.size(), 15u);
    double worst = 0;
    for (std::size_t r = 0; r < bad.size(); ++r)
      for (int k = 0; k < Model::kColumns; ++k)
        if (known[r].sd[k] > 0)
          worst = std::max(worst, std::abs(static_cast<double>(bad[r].value[k]) - known[r].value[k]) / known[r].sd[k]);
    EXPECT_LE(worst, 1) << name;
    RecordProperty(name, std::to_string(worst));
  }
};
using GlitchFilters =
    testing::Types<filter::ForgettingFilter<Model>, filter::KalmanFilter<Model, filter::Form::kBlock>,
                   filter::KalmanFilter<Model>, filter::ExtendedKalmanFilter<Model>, filter::ModelBank<Model>>;

}  // namespace armcal::estimator::test
