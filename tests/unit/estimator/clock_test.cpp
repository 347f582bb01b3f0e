// estimator - clocks that pass 2^24, 2^31 and 2^32.
#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;

// The offset of joint 1 grows with the time since the adoption.
struct Drifting : TwoLink {
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    TwoLink::Regressor(x, committed, eta, state, next, front, dense);
    front[2] = x.t;
  }
};

constexpr int kAround = 2000, kBefore = 1000;  // samples around the clock's passage
constexpr std::uint32_t kPassages[] = {1u << 24, 1u << 31, 0u /* 2^32 */};

std::uint32_t StartBefore(std::uint32_t passage) {
  return passage - static_cast<std::uint32_t>(kBefore * TwoLink::kSampleTicks);
}

template <class Filter>
struct Clock : testing::Test {
  static constexpr int kOffset = TwoLink::kBodyParameters + 2;
  // Estimates after kAround, the clock at adoption being `start`.
  static Estimates<Drifting> Run(std::uint32_t start, monitor::ResidualStatistics<2>* statistics = nullptr) {
    auto host = std::make_unique<Host<Drifting, Filter>>();
    host->table.parameter[kOffset].state = model::ParameterState::kEstimated;
    host->estimator.SetResiduals(statistics);
    EXPECT_EQ(BuildAdoptedTable<Drifting>(host->table, 1, host->rigid, host->adopted), Status::kOk);
    host->estimator.Adopt(host->adopted, start);
    Motion run;
    for (int k = 0; k < kAround; ++k) {
      Sample s = run.Next();
      s.tick += start;
      EXPECT_EQ(host->Feed(s), Status::kOk);
    }
    return host->Read();
  }
};
using DriftingFilters = testing::Types<filter::ForgettingFilter<Drifting>, filter::KalmanFilter<Drifting>>;
TYPED_TEST_SUITE(Clock, DriftingFilters);

TYPED_TEST(Clock, WhateverItPasses_TheEstimatesAreTheSameBits) {
  const Estimates<Drifting> zero = this->Run(0);
  for (const std::uint32_t passage : kPassages) {
    const std::uint32_t start = StartBefore(passage);
    Estimates<Drifting> e = this->Run(start);
    e.tick -= start;
    EXPECT_EQ(Bits(e), Bits(zero)) << passage;
  }
}

TYPED_TEST(Clock, WhateverItPasses_TheStatisticsCountTheSameSeconds) {
  for (const std::uint32_t passage : kPassages) {
    auto statistics = std::make_unique<monitor::ResidualStatistics<2>>();
    this->Run(StartBefore(passage), statistics.get());
    EXPECT_EQ(statistics->elapsed_s(), 15u) << passage;  // the last of 2000 samples of 8 ms begins at 15.992 s
  }
}

TYPED_TEST(Clock, WhateverItPasses_RawTicksGiveTheSameBitsAndNoGap) {
  std::vector<float> torque[4];
  int at = 0;
  for (const std::uint32_t passage : {8000u, kPassages[0], kPassages[1], kPassages[2]}) {
    auto host = std::make_unique<Host<Drifting, TypeParam>>();
    ASSERT_EQ(host->Adopt(), Status::kOk);
    host->estimator.SetObserver(
        [](void* list, const Sample& s, const float*) {
          for (const float x : {s.q[0], s.qd[1], s.qdd[1], s.tau[0]})
            static_cast<std::vector<float>*>(list)->push_back(x);
        },
        &torque[at++]);
    for (std::uint32_t k = 0; k < 8000; ++k) {
      model::RawSample<2> raw;
      raw.tick = passage - 4000u + k;
      for (int i = 0; i < 2; ++i) {
        raw.counts[i] = static_cast<std::int32_t>(4e5 * std::sin(k * (1 + i) * 1.3e-3));
        raw.current[i] = static_cast<std::int16_t>(200 * std::cos(k * 2e-3));
        raw.flags[i] = model::kEnabled;
      }
      ASSERT_EQ(host->estimator.Push(raw), Status::kOk);
      host->Drain();
    }
    EXPECT_EQ(host->estimator.tick_gaps(), 0u);
  }
  ASSERT_EQ(torque[0].size(), 4 * (8000u / 8 - 4));
  for (int k = 1; k < 4; ++k) EXPECT_EQ(torque[k], torque[0]) << kPassages[k - 1];
}

}  // namespace
}  // namespace armcal::estimator
