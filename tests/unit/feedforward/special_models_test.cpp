// feedforward - models with memory, and with a pair effect that may be no number.
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "armcal/feedforward/feed_forward.hpp"
#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal::feedforward {
namespace {

using core::Status;
using test::CountingTwoLink;
using test::TwoLink;

// The coupling between the joints reads a sensor that is not there.
struct WithoutSensor : TwoLink {
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    TwoLink::Regressor(x, committed, eta, state, next, front, dense);
    dense[7] = dense[kDense + 7] = T(std::numeric_limits<float>::quiet_NaN());
  }
};

template <class Model>
model::Committed<Model> Table(int column, float value) {
  model::Committed<Model> c;
  c.valid = true;
  c.p[column] = value;
  c.eta[0] = 0.1f;
  for (float& limit : c.limit_Nm) limit = 1000.0f;
  return c;
}

const float kQ[2] = {0.4f, -0.9f}, kQd[2] = {0.7f, -1.1f}, kQdd[2] = {2.0f, 3.0f}, kTemp[2] = {30, 30};

TEST(SpecialModels, NextTable_StartsEffectsWithMemoryAnew) {
  auto ff = std::make_unique<FeedForward<CountingTwoLink>>();
  float tau[2];
  for (int table = 0; table < 2; ++table) {
    ASSERT_EQ(ff->Offer(Table<CountingTwoLink>(3, 1.0f), false), Status::kOk);
    for (int tick = 0; tick < 5; ++tick) {
      ASSERT_EQ(ff->Evaluate(kQ, kQd, kQdd, kTemp, 0.0f, false, tau), Status::kOk);
      EXPECT_EQ(tau[1], static_cast<float>(tick)) << table;
    }
  }
}

TEST(SpecialModels, PairEffectInStandby_AddsNothingEvenIfItsValueIsNotFinite) {
  auto ff = std::make_unique<FeedForward<WithoutSensor>>();
  float tau[2];
  ASSERT_EQ(ff->Offer(Table<WithoutSensor>(1, 2.0f), false), Status::kOk);
  EXPECT_EQ(ff->Evaluate(kQ, kQd, kQdd, kTemp, 0.0f, false, tau), Status::kOk);
  EXPECT_EQ(tau[0], 2.0f * kQd[0]);
  EXPECT_EQ(tau[1], 0.0f);
}

}  // namespace
}  // namespace armcal::feedforward
