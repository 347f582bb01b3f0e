// estimator - hours of virtual time at one sample after the other, with the clock passing a power of two half way.
#pragma once

#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator::test {

// A minute of motion over and over, with fresh noise.
class EndlessMotion {
 public:
  explicit EndlessMotion(std::uint32_t tick) : tick_(tick) {
    for (int k = 0; k < 60 * 125; ++k) {
      minute_.push_back(run_.Next());
      const Vector tau = Regressor<TwoLink>(minute_.back()) * run_.truth;
      for (int i = 0; i < 2; ++i) minute_.back().tau[i] = static_cast<float>(tau(i));
    }
  }
  Sample Next() {
    Sample s = minute_[at_++ % minute_.size()];
    s.tick = tick_;
    tick_ += TwoLink::kSampleTicks;
    for (int i = 0; i < 2; ++i) s.tau[i] += TwoLink::kAxes[i].sigma_Nm * static_cast<float>(run_.normal(run_.random));
    return s;
  }

 private:
  Motion run_;
  std::vector<Sample> minute_;
  std::size_t at_ = 0;
  std::uint32_t tick_;
};

inline std::uint32_t HalfWayTo(std::uint32_t passage, int hours) {
  return passage - static_cast<std::uint32_t>(hours) * 1800u * 1000u;
}

template <class Filter>
std::unique_ptr<Host<TwoLink, Filter>> Adopted(std::uint32_t tick) {
  auto host = std::make_unique<Host<TwoLink, Filter>>();
  for (float& lambda : host->table.forgetting) lambda = 0.999f;
  EXPECT_EQ(BuildAdoptedTable<TwoLink>(host->table, 1, host->rigid, host->adopted), core::Status::kOk);
  host->estimator.Adopt(host->adopted, tick);
  host->estimator.SetPublishEvery(1u << 30);
  return host;
}

// What a filter with a memory of 8 s knows is what the last ten minutes told it, whatever was before.
inline void ForgettingKnowsOnlyTheLastMinutes(int hours, std::uint32_t passage) {
  using Filter = filter::ForgettingFilter<TwoLink>;
  const std::uint32_t start = HalfWayTo(passage, hours);
  EndlessMotion run(start);
  auto host = Adopted<Filter>(start), young = Adopted<Filter>(start);
  const long samples = hours * 3600l * 125, last = samples - 600l * 125;
  for (long k = 0; k < samples; ++k) {
    const Sample s = run.Next();
    ASSERT_EQ(host->Feed(s), core::Status::kOk);
    if (k >= last) {
      ASSERT_EQ(young->Feed(s), core::Status::kOk);
    }
  }
  const Estimates<TwoLink>&a = host->Read(), &b = young->Read();
  EXPECT_EQ(a.samples, static_cast<std::uint32_t>(samples));
  EXPECT_EQ(a.tick, start + static_cast<std::uint32_t>(samples - 1) * TwoLink::kSampleTicks);
  for (int k = 0; k < kColumns; ++k) {
    EXPECT_NEAR(a.value[k], b.value[k], 1e-3 * b.sd[k]) << k;  // 0.999^75000 of the hours before is nothing
    EXPECT_NEAR(a.sd[k], b.sd[k], 1e-3 * b.sd[k]) << k;
  }
}

// At each full hour the truth lies where the filter says, and its innovations have the size that it says.
inline void KalmanStaysWithTheTruth(int hours, std::uint32_t passage) {
  const std::uint32_t start = HalfWayTo(passage, hours);
  EndlessMotion run(start);
  auto host = Adopted<filter::KalmanFilter<TwoLink>>(start);
  const Vector truth = Motion().truth;
  for (int hour = 0; hour < hours; ++hour) {
    for (int k = 0; k < 3600 * 125; ++k) ASSERT_EQ(host->Feed(run.Next()), core::Status::kOk);
    const Estimates<TwoLink>& e = host->Read();
    for (int k = 0; k < kColumns; ++k) {
      if (e.sd[k] == 0.0f) continue;  // standby
      EXPECT_LT(std::abs(e.value[k] - truth(k)) / e.sd[k], 5) << k << " after hour " << hour;
    }
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(e.nis[i], 1, 0.15) << i << " after hour " << hour;
  }
}

}  // namespace armcal::estimator::test
