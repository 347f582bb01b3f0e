// estimator - what a table brings into force, and when.
#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;

template <class Filter>
struct Adoption : testing::Test {
  using Arm = Host<TwoLink, Filter>;
  std::unique_ptr<Arm> host = std::make_unique<Arm>(), other = std::make_unique<Arm>();
};
using Filters = testing::Types<filter::ForgettingFilter<TwoLink>, filter::KalmanFilter<TwoLink>>;
TYPED_TEST_SUITE(Adoption, Filters);

// However far the work on a sample, its rows or (every second time) a read-out has come.
TYPED_TEST(Adoption, AtAnyPointOfTheWork_StartsAsIfNothingHadBeen) {
  for (int pieces = 1; pieces < 500; pieces += 7) {
    Motion run;
    ASSERT_EQ(this->host->Adopt(static_cast<std::uint32_t>(2 * pieces)), Status::kOk);
    for (int k = 0; k < 20; ++k) ASSERT_EQ(this->host->Feed(run.Next()), Status::kOk);
    ASSERT_EQ(this->host->estimator.PushSample(run.Next()), Status::kOk);
    if (pieces % 2 == 0) this->host->estimator.RequestReadOut();
    for (int piece = 0; piece < pieces; ++piece) static_cast<void>(this->host->estimator.Step(1));
    const std::uint32_t generation = static_cast<std::uint32_t>(2 * pieces + 1);
    ASSERT_EQ(this->host->Adopt(generation), Status::kOk);
    this->other = std::make_unique<typename TestFixture::Arm>();
    ASSERT_EQ(this->other->Adopt(generation), Status::kOk);
    for (int k = 0; k < 20; ++k) {
      const Sample s = run.Next();
      ASSERT_EQ(this->host->Feed(s), Status::kOk);
      ASSERT_EQ(this->other->Feed(s), Status::kOk);
    }
    Estimates<TwoLink> a = this->host->Read(), b = this->other->Read();
    a.stale = b.stale = 0;  // the one that waited may have been dropped
    EXPECT_EQ(Bits(a), Bits(b)) << pieces;
  }
}

TYPED_TEST(Adoption, LeavesNoReadOutOfTheTableBefore) {
  Motion run;
  ASSERT_EQ(this->host->Adopt(1), Status::kOk);
  for (int k = 0; k < 20; ++k) ASSERT_EQ(this->host->Feed(run.Next()), Status::kOk);
  this->host->Read();
  EXPECT_NE(this->host->estimator.read_out(), nullptr);
  ASSERT_EQ(this->host->Adopt(2), Status::kOk);
  EXPECT_EQ(this->host->estimator.read_out(), nullptr);
}

TYPED_TEST(Adoption, TorqueScaleOfTheTable_MultipliesTheMeasuredTorque) {
  this->other->table.joint[1].torque_scale = 1.25f;  // exact in float
  std::vector<Sample> seen[2];
  typename TestFixture::Arm* const hosts[2] = {this->host.get(), this->other.get()};
  for (int h = 0; h < 2; ++h) {
    ASSERT_EQ(hosts[h]->Adopt(), Status::kOk);
    hosts[h]->estimator.SetObserver(
        [](void* list, const Sample& s, const float*) { static_cast<std::vector<Sample>*>(list)->push_back(s); },
        &seen[h]);
    for (std::uint32_t tick = 0; tick < 400; ++tick) {
      model::RawSample<2> raw;
      raw.tick = tick;
      for (int i = 0; i < 2; ++i) {
        raw.counts[i] = static_cast<std::int32_t>(50 * tick);
        raw.current[i] = static_cast<std::int16_t>(300 + 7 * tick % 50);
        raw.flags[i] = model::kEnabled;
      }
      ASSERT_EQ(hosts[h]->estimator.Push(raw), Status::kOk);
      hosts[h]->Drain();
    }
  }
  ASSERT_EQ(seen[0].size(), 400u / 8 - 4);
  ASSERT_EQ(seen[1].size(), seen[0].size());
  for (std::size_t k = 0; k < seen[0].size(); ++k) {
    EXPECT_EQ(seen[1][k].tau[0], seen[0][k].tau[0]);
    EXPECT_EQ(seen[1][k].tau[1], 1.25f * seen[0][k].tau[1]);
  }
}

// A saturated or disabled axis moves as well.
TYPED_TEST(Adoption, RowThatMovesButIsNotValid_IsGated) {
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  Motion run;
  for (int k = 0; k < 200; ++k) {
    Sample s = run.Next();
    s.flags[1] &= static_cast<std::uint8_t>(~model::kValid);
    ASSERT_EQ(this->host->Feed(s), Status::kOk);
  }
  const Estimates<TwoLink>& e = this->host->Read();
  EXPECT_GT(e.rows_used[0], 150u);
  EXPECT_EQ(e.rows_used[1], 0u);
  EXPECT_EQ(e.rows_gated[1], 200u);
}

}  // namespace
}  // namespace armcal::estimator
