// estimator - what enters an estimator, what it refuses, and what it publishes.
#include "armcal/estimator/estimator.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;
using filter::ForgettingFilter;
using filter::KalmanFilter;

template <class Filter>
class Both : public testing::Test {
 protected:
  std::unique_ptr<Host<TwoLink, Filter>> host = std::make_unique<Host<TwoLink, Filter>>();
  Motion run;
  void Move(int samples) {
    for (int k = 0; k < samples; ++k) ASSERT_EQ(host->Feed(run.Next()), Status::kOk);
  }
};
using Filters = testing::Types<ForgettingFilter<TwoLink>, KalmanFilter<TwoLink>>;
TYPED_TEST_SUITE(Both, Filters);

TYPED_TEST(Both, BeforeATable_DropsSamplesAndPublishesNothing) {
  this->Move(3);
  EXPECT_FALSE(this->host->estimator.Take(this->host->estimates));
}

TYPED_TEST(Both, AfterAdoption_ReadsThePrior) {
  ASSERT_EQ(this->host->Adopt(4), Status::kOk);
  const auto& e = this->host->Read();
  EXPECT_EQ(e.generation, 4u);
  for (int k = 0; k < kColumns; ++k) {
    EXPECT_EQ(e.value[k], this->host->adopted.committed.p[k]);
    EXPECT_NEAR(e.sd[k], this->host->adopted.scale[k], 2e-5f * this->host->adopted.scale[k]);
  }
}

TYPED_TEST(Both, OneHourOfRest_LeavesTheEstimate) {
  this->host->table.forgetting[0] = this->host->table.forgetting[1] = 0.995f;
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->Move(500);
  const Estimates<TwoLink> before = this->host->Read();
  const Sample rest = this->run.Next(true);
  this->host->estimator.SetPublishEvery(1u << 30);
  for (int k = 0; k < 125 * 3600; ++k) ASSERT_EQ(this->host->Feed(rest), Status::kOk);
  const Estimates<TwoLink>& after = this->host->Read();
  EXPECT_EQ(after.rows_gated[0], before.rows_gated[0] + 125 * 3600);
  EXPECT_EQ(std::memcmp(before.value, after.value, sizeof before.value), 0);
  EXPECT_EQ(std::memcmp(before.sd, after.sd, sizeof before.sd), 0);
}

TYPED_TEST(Both, NotFiniteSample_IsRefusedAndCounted) {
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->Move(200);
  const Estimates<TwoLink> before = this->host->Read();
  Sample s = this->run.Next();
  s.tau[0] = std::numeric_limits<float>::quiet_NaN();
  s.qdd[1] = std::numeric_limits<float>::infinity();
  ASSERT_EQ(this->host->Feed(s), Status::kOk);
  const Estimates<TwoLink>& after = this->host->Read();
  EXPECT_EQ(after.rows_refused[0], 1u);
  EXPECT_EQ(after.rows_refused[1], 1u);
  EXPECT_EQ(std::memcmp(before.value, after.value, sizeof before.value), 0);
}

TYPED_TEST(Both, FixedAndStandbyColumns_DoNotMove_ConsideredOnlyInTheKalmanForm) {
  using model::ParameterState;
  this->host->table.parameter[22].state = ParameterState::kFixed;       // Fc1
  this->host->table.parameter[26].state = ParameterState::kConsidered;  // Fv2
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->Move(1000);
  const Estimates<TwoLink>& e = this->host->Read();
  EXPECT_EQ(e.value[0], 8.0f);
  EXPECT_EQ(e.sd[0], 0.0f);
  EXPECT_EQ(e.value[2], 0.0f);
  EXPECT_EQ(e.value[kColumns - 1], 0.0f);
  const bool kalman = std::is_same_v<TypeParam, KalmanFilter<TwoLink>>;
  EXPECT_EQ(e.value[4] == 2.0f, kalman);
  EXPECT_EQ(e.sd[4] > 0.99f, kalman);
}

TYPED_TEST(Both, FixedColumn_IsSubtracted) {
  // Truth and table agree on Fc1: fixing it must not bias the others.
  this->host->table.parameter[22].state = model::ParameterState::kFixed;
  this->host->table.parameter[22].mean = static_cast<float>(this->run.truth(0));
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->Move(2000);
  const Estimates<TwoLink>& e = this->host->Read();
  EXPECT_LT(std::abs(e.value[1] - this->run.truth(1)) / e.sd[1], 4);
}

TYPED_TEST(Both, ActivatedStandbyEffect_IsEstimatedAfterANewTable) {
  this->run.truth(2) = 1.5;  // torque offset of joint 1 that the table keeps in standby
  ASSERT_EQ(this->host->Adopt(1), Status::kOk);
  this->Move(1000);
  const float residual_before = this->host->Read().residual_rms_Nm[0];
  this->host->table.parameter[24].state = model::ParameterState::kEstimated;
  const Estimates<TwoLink> e = this->host->Read();
  for (int k = 0; k < 2; ++k) this->host->table.parameter[22 + k].mean = e.value[k];
  ASSERT_EQ(this->host->Adopt(2), Status::kOk);
  this->Move(2000);
  const Estimates<TwoLink>& after = this->host->Read();
  EXPECT_EQ(after.generation, 2u);
  EXPECT_EQ(after.samples, 2000u);
  EXPECT_NEAR(after.value[2], 1.5, 5 * after.sd[2]);
  EXPECT_LT(after.sd[2], 0.1);
  EXPECT_GT(residual_before, 0.5f);
}

TYPED_TEST(Both, RawTicksAndProcessedSamples_GiveTheSameBits) {
  this->host->table.joint[1].torque_scale = 1.02f;
  auto other = std::make_unique<Host<TwoLink, TypeParam>>();
  other->table = this->host->table;
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  ASSERT_EQ(other->Adopt(), Status::kOk);
  std::vector<Sample> samples;
  this->host->estimator.SetObserver(
      [](void* context, const Sample& s, const float*) { static_cast<std::vector<Sample>*>(context)->push_back(s); },
      &samples);
  std::mt19937 random(1);
  for (std::uint32_t tick = 0; tick < 8000; ++tick) {
    model::RawSample<2> raw;
    raw.tick = tick;
    for (int i = 0; i < 2; ++i) {
      raw.counts[i] = static_cast<std::int32_t>(4e5 * std::sin(tick * (1 + i) * 1.3e-3));
      raw.current[i] = static_cast<std::int16_t>(200 * std::cos(tick * 2e-3) + static_cast<int>(random() % 20));
      raw.flags[i] = model::kEnabled;
      raw.temperature_degC[i] = 25;
    }
    ASSERT_EQ(this->host->estimator.Push(raw), Status::kOk);
    this->host->Drain();
  }
  ASSERT_EQ(samples.size(), 8000u / 8 - 4);
  int used = 0;
  for (Sample s : samples) {
    used += (s.flags[0] & model::kUsed) != 0;
    ASSERT_EQ(other->Feed(s), Status::kOk);
  }
  EXPECT_GT(used, 900);
  const Estimates<TwoLink>&a = this->host->Read(), &b = other->Read();
  EXPECT_EQ(a.rows_used[0], static_cast<std::uint32_t>(used));
  EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
}

TYPED_TEST(Both, Observer_SeesUsedRowsAndTheCommittedModelTorque) {
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  struct Seen {
    Sample sample;
    float tau[2];
  } seen = {};
  this->host->estimator.SetObserver(
      [](void* context, const Sample& s, const float* tau) { *static_cast<Seen*>(context) = {s, {tau[0], tau[1]}}; },
      &seen);
  Sample s = this->run.Next();
  s.flags[1] = model::kValid | model::kUsed;  // not moving; a flag from elsewhere must not survive
  ASSERT_EQ(this->host->Feed(s), Status::kOk);
  EXPECT_EQ(seen.sample.tick, s.tick);
  EXPECT_NE(seen.sample.flags[0] & model::kUsed, 0);
  EXPECT_EQ(seen.sample.flags[1] & model::kUsed, 0);
  const Vector expected = Regressor<TwoLink>(s) * this->host->b0();
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(seen.tau[i], expected(i), 1e-4);
}

TYPED_TEST(Both, FullRing_RefusesTheNewSampleWholeAndCounts) {
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->host->Drain();
  const auto capacity = std::remove_reference_t<decltype(this->host->estimator)>::kRingSamples;
  for (std::uint32_t k = 0; k < capacity; ++k)
    ASSERT_EQ(this->host->estimator.PushSample(this->run.Next()), Status::kOk);
  EXPECT_EQ(this->host->estimator.PushSample(this->run.Next()), Status::kFull);
  const Estimates<TwoLink>& e = this->host->Read();
  EXPECT_EQ(e.samples, capacity);
  EXPECT_EQ(e.refused, 1u);
}

TYPED_TEST(Both, SamplesOfAnOlderTable_AreDropped) {
  ASSERT_EQ(this->host->Adopt(1), Status::kOk);
  this->host->Drain();
  for (int k = 0; k < 5; ++k) ASSERT_EQ(this->host->estimator.PushSample(this->run.Next()), Status::kOk);
  ASSERT_EQ(this->host->Adopt(2), Status::kOk);
  const Estimates<TwoLink>& e = this->host->Read();
  EXPECT_EQ(e.samples, 0u);
  EXPECT_EQ(e.stale, 5u);
}

TYPED_TEST(Both, AnyBudget_GivesTheSameBits) {
  auto other = std::make_unique<Host<TwoLink, TypeParam>>();
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  ASSERT_EQ(other->Adopt(), Status::kOk);
  int calls = 0;
  for (int k = 0; k < 300; ++k) {
    const Sample s = this->run.Next();
    ASSERT_EQ(this->host->Feed(s), Status::kOk);
    ASSERT_EQ(other->estimator.PushSample(s), Status::kOk);
    for (; other->estimator.Step(1); ++calls) {
    }
  }
  EXPECT_GT(calls, 300 * 20);  // every column or two stood alone
  const Estimates<TwoLink>&a = this->host->Read(), &b = other->Read();
  EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
}

// With the first sample of a period of ticks: 50 samples are 400 ticks.
TYPED_TEST(Both, PublishesByItselfEverySoManySamples) {
  ASSERT_EQ(this->host->Adopt(), Status::kOk);
  this->host->Drain();
  ASSERT_TRUE(this->host->estimator.Take(this->host->estimates));
  this->host->estimator.SetPublishEvery(50);
  for (const std::uint32_t period : {1u, 2u}) {
    this->Move(period == 1u ? 50 : 49);
    EXPECT_FALSE(this->host->estimator.Take(this->host->estimates));
    this->Move(1);
    ASSERT_TRUE(this->host->estimator.Take(this->host->estimates));
    EXPECT_EQ(this->host->estimates.samples, 50u * period + 1u);
    EXPECT_EQ(this->host->estimates.tick, 400u * period);
  }
}

// What a form cannot hold is said before it is adopted.
TEST(Forms, BlockAndBankRefuseNoiseOnSharedColumns_TheOthersDoNot) {
  Table<TwoLink> table = DefaultTable<TwoLink>();
  auto rigid = std::make_unique<physical::RigidPrior<TwoLink, float>>();
  auto adopted = std::make_unique<AdoptedTable<TwoLink>>();
  using Block = Estimator<TwoLink, KalmanFilter<TwoLink, filter::Form::kBlock>>;
  using Bank = Estimator<TwoLink, filter::ModelBank<TwoLink>>;
  ASSERT_EQ(BuildAdoptedTable<TwoLink>(table, 1, *rigid, *adopted), Status::kOk);
  EXPECT_TRUE(Block::Suits(*adopted));
  EXPECT_TRUE(Bank::Suits(*adopted));
  table.parameter[29].state = model::ParameterState::kEstimated;  // coupling friction, on both joints
  table.parameter[29].process_noise = 1e-6f;
  ASSERT_EQ(BuildAdoptedTable<TwoLink>(table, 1, *rigid, *adopted), Status::kOk);
  EXPECT_FALSE(Block::Suits(*adopted));
  EXPECT_FALSE(Bank::Suits(*adopted));
  EXPECT_TRUE((Estimator<TwoLink, KalmanFilter<TwoLink>>::Suits(*adopted)));
  EXPECT_TRUE((Estimator<TwoLink, ForgettingFilter<TwoLink>>::Suits(*adopted)));
}

}  // namespace
}  // namespace armcal::estimator
