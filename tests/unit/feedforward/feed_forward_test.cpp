// feedforward - set-point torque against the same sum in double.
#include "armcal/feedforward/feed_forward.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal::feedforward {
namespace {

using test::TwoLink;
using Set = model::Committed<TwoLink>;
using core::Status;

Set Example(std::uint32_t generation) {
  Set c;
  c.valid = true;
  c.generation = generation;
  const float p[TwoLink::kColumns] = {8, 5, 0, 4, 2, 0, 0, 3.0f, 4.5f, 0.2f, 1.0f, -0.1f, 0.25f, 0.3f, 0};
  std::copy(p, p + TwoLink::kColumns, c.p);
  c.eta[0] = 0.1f;
  for (int i = 0; i < 2; ++i) {
    c.limit_Nm[i] = 500.0f;
    c.v_min_radps[i] = 0.01f;
    c.torque_scale[i] = 1.0f;
  }
  return c;
}

struct FeedForwardTest : testing::Test {
  std::unique_ptr<FeedForward<TwoLink>> ff = std::make_unique<FeedForward<TwoLink>>();
  float q[2] = {0.4f, -0.9f}, qd[2] = {0.7f, -1.1f}, qdd[2] = {2.0f, 3.0f}, temp[2] = {30, 30}, tau[2] = {-1, -1};
  Status Evaluate(bool enabled = false) { return ff->Evaluate(q, qd, qdd, temp, 0.0f, enabled, tau); }
  double Exact(const Set& c, int joint) const {
    model::ModelInput<double, 2> x{{q[0], q[1]}, {qd[0], qd[1]}, {qdd[0], qdd[1]}, {30, 30}, 0, 0};
    const double eta[1] = {c.eta[0]};
    double front[TwoLink::kFront], dense[2 * TwoLink::kDense], sum = 0;
    TwoLink::Regressor<double>(x, nullptr, eta, nullptr, nullptr, front, dense);
    for (int k = TwoLink::kFrontBegin[joint]; k < TwoLink::kFrontBegin[joint + 1]; ++k) sum += front[k] * c.p[k];
    for (int k = 0; k < TwoLink::kDense; ++k) sum += dense[joint * TwoLink::kDense + k] * c.p[TwoLink::kFront + k];
    return sum;
  }
};

TEST_F(FeedForwardTest, WithoutTable_IsZeroAndSaysSo) {
  EXPECT_EQ(Evaluate(), Status::kEmpty);
  EXPECT_EQ(tau[0], 0.0f);
  EXPECT_EQ(tau[1], 0.0f);
  EXPECT_FALSE(ff->valid());
}

TEST_F(FeedForwardTest, CommittedTable_GivesTheModelTorque) {
  ASSERT_EQ(ff->Offer(Example(3), false), Status::kOk);
  EXPECT_EQ(ff->generation(), 0u);
  EXPECT_EQ(Evaluate(), Status::kOk);
  EXPECT_EQ(ff->generation(), 3u);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(tau[i], Exact(Example(3), i), 1e-5 * 50);
}

TEST_F(FeedForwardTest, SetPointBelowVMin_HasNoFriction) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  qd[0] = 0.009f;
  EXPECT_EQ(Evaluate(), Status::kOk);
  qd[0] = 0.0f;
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(tau[i], Exact(Example(1), i), 1e-5 * 50);
}

TEST_F(FeedForwardTest, TorqueBeyondTheLimit_IsCutAndCounted) {
  Set c = Example(1);
  c.limit_Nm[0] = 10.0f;
  ASSERT_EQ(ff->Offer(c, false), Status::kOk);
  EXPECT_EQ(Evaluate(), Status::kClamped);
  EXPECT_EQ(tau[0], 10.0f);
  EXPECT_EQ(Evaluate(), Status::kClamped);
  EXPECT_EQ(ff->clamp_count(), 2u);
}

TEST_F(FeedForwardTest, NotFiniteSetPoint_GivesZeroAndSaysSo) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  qdd[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Evaluate(), Status::kNotFinite);
  EXPECT_EQ(tau[0], 0.0f);
  EXPECT_EQ(tau[1], 0.0f);
}

TEST_F(FeedForwardTest, ColumnInStandby_AddsNothingEvenIfItsValueIsNotFinite) {
  Set c = Example(1);
  c.eta[0] = 0.0f;  // qd / 0: the Stribeck column is not a number
  qd[1] = 0.0f;
  ASSERT_EQ(ff->Offer(c, false), Status::kOk);
  EXPECT_EQ(Evaluate(), Status::kOk);
  EXPECT_NEAR(tau[0], Exact(Example(1), 0), 1e-5 * 50);
}

TEST_F(FeedForwardTest, PlainTableWhileEnabled_IsRefusedAndChangesNothing) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  std::vector<unsigned char> before(sizeof *ff), after(sizeof *ff);
  std::memcpy(before.data(), static_cast<void*>(ff.get()), sizeof *ff);
  EXPECT_EQ(ff->Offer(Example(2), true), Status::kAxisEnabled);
  std::memcpy(after.data(), static_cast<void*>(ff.get()), sizeof *ff);
  EXPECT_EQ(before, after);
}

// The tick may enable an axis after the background has offered the table.
TEST_F(FeedForwardTest, PlainTable_IsCrossFadedIfAnAxisIsEnabledAfterItsOffer) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  const float from = tau[0];
  Set c = Example(2);
  for (float& p : c.p) p *= 2;
  c.blend_ticks = 100;
  ASSERT_EQ(ff->Offer(c, false), Status::kOk);
  for (int tick = 1; tick <= 120; ++tick) {
    ASSERT_EQ(Evaluate(true), Status::kOk);
    EXPECT_NEAR(tau[0], from * (1 + std::min(tick, 100) / 100.0), 1e-4);
  }
}

TEST_F(FeedForwardTest, BumplessTable_IsCrossFadedWithoutAStep) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  const float from = tau[0];
  Set c = Example(2);
  for (float& p : c.p) p *= 2;
  c.bumpless = true;
  c.blend_ticks = 100;
  ASSERT_EQ(ff->Offer(c, true), Status::kOk);
  for (int tick = 1; tick <= 120; ++tick) {
    ASSERT_EQ(Evaluate(), Status::kOk);
    EXPECT_NEAR(tau[0], from * (1 + std::min(tick, 100) / 100.0), 1e-4);
    EXPECT_EQ(ff->blending(), tick < 100);
  }
  EXPECT_NEAR(tau[0], Exact(c, 0), 1e-5 * 100);
}

// The current is the torque over the torque scale. So the inverse of the scale goes in equal steps, also when a fade
// begins inside a fade.
TEST_F(FeedForwardTest, TorqueScale_FadesLikeTheTorque) {
  EXPECT_EQ(ff->torque_scale(0), 1.0f);
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  EXPECT_EQ(ff->torque_scale(0), 1.0f);
  Set next = Example(2);
  next.bumpless = true, next.blend_ticks = 100;
  next.torque_scale[0] = 0.5f, next.torque_scale[1] = 2.0f;
  ASSERT_EQ(ff->Offer(next, true), Status::kOk);
  for (int k = 1; k <= 40; ++k) {
    ASSERT_EQ(Evaluate(), Status::kOk);
    EXPECT_NEAR(1 / ff->torque_scale(0), 1 + 0.01 * k, 1e-5) << k;
    EXPECT_NEAR(1 / ff->torque_scale(1), 1 - 0.005 * k, 1e-5) << k;
  }
  next.generation = 3, next.torque_scale[0] = 1.0f;
  ASSERT_EQ(ff->Offer(next, true), Status::kOk);
  for (int k = 1; k <= 120; ++k) {
    ASSERT_EQ(Evaluate(), Status::kOk);
    EXPECT_NEAR(1 / ff->torque_scale(0), 1.4 - 0.004 * std::min(k, 100), 1e-5) << k;
  }
  EXPECT_EQ(ff->torque_scale(1), 2.0f);
}

TEST_F(FeedForwardTest, FirstBumplessTable_FadesInFromZero) {
  Set c = Example(1);
  c.bumpless = true;
  c.blend_ticks = 80;
  ASSERT_EQ(ff->Offer(c, true), Status::kOk);
  for (int tick = 0; tick < 20; ++tick) EXPECT_EQ(Evaluate(), Status::kOk);
  EXPECT_NEAR(tau[0], 0.25 * Exact(c, 0), 1e-4);
}

// Whatever a table asks for, a bumpless one takes the shortest fade at least: 50 ms are 50 ticks.
TEST_F(FeedForwardTest, FadeOfZeroMs_TakesTheShortestFade) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  Set c = Example(2);
  for (float& p : c.p) p *= 3;
  c.bumpless = true;
  ASSERT_EQ(ff->Offer(c, true), Status::kOk);
  for (int tick = 1; tick <= 60; ++tick) {
    ASSERT_EQ(Evaluate(), Status::kOk);
    EXPECT_NEAR(tau[0], (1 + 2 * std::min(tick, 50) / 50.0) * Exact(Example(1), 0), 1e-3) << tick;
  }
}

// The tables differ in everything: amplitudes, and an eta that a column depends on. The oracle knows only that nothing
// may move by more than a tick's share of what is left.
TEST_F(FeedForwardTest, FadeInsideAFade_StartsFromThePresentTorque) {
  Set first = Example(1);
  first.p[6] = 6.0f;  // the column that depends on eta
  ASSERT_EQ(ff->Offer(first, false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  Set second = first, third = first;
  second.generation = 2, third.generation = 3;
  for (float& p : second.p) p *= 4;
  for (float& p : third.p) p *= -2;
  second.eta[0] = 2.0f, third.eta[0] = 0.7f;
  second.bumpless = third.bumpless = true;
  second.blend_ticks = third.blend_ticks = 100;
  ASSERT_EQ(ff->Offer(second, true), Status::kOk);
  for (int tick = 0; tick < 40; ++tick) ASSERT_EQ(Evaluate(), Status::kOk);
  const float present[2] = {tau[0], tau[1]};
  for (int i = 0; i < 2; ++i) ASSERT_NEAR(present[i], 0.6 * Exact(first, i) + 0.4 * Exact(second, i), 1e-3);
  ASSERT_EQ(ff->Offer(third, true), Status::kOk);
  for (int tick = 1; tick <= 110; ++tick) {
    ASSERT_EQ(Evaluate(), Status::kOk);
    const double share = std::min(tick, 100) / 100.0;
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(tau[i], (1 - share) * present[i] + share * Exact(third, i), 2e-3) << tick;
  }
}

// What an interrupted fade starts from goes on to follow the motion: it is torque of the mixed table, not a number.
TEST_F(FeedForwardTest, FadeInsideAFade_FollowsTheMotion) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  Set second = Example(2), third = Example(3);
  for (float& p : second.p) p *= 4;
  for (float& p : third.p) p *= -2;
  second.bumpless = third.bumpless = true;
  second.blend_ticks = third.blend_ticks = 100;
  ASSERT_EQ(ff->Offer(second, true), Status::kOk);
  for (int tick = 0; tick < 40; ++tick) ASSERT_EQ(Evaluate(), Status::kOk);
  ASSERT_EQ(ff->Offer(third, true), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  q[0] = -1.1f, qd[0] = -0.4f, qdd[1] = -6.0f;
  ASSERT_EQ(Evaluate(), Status::kOk);
  for (int i = 0; i < 2; ++i) {
    const double mixed = 0.6 * Exact(Example(1), i) + 0.4 * Exact(second, i);
    EXPECT_NEAR(tau[i], 0.98 * mixed + 0.02 * Exact(third, i), 2e-3);
  }
}

TEST_F(FeedForwardTest, LimitOfTheNextTable_ComesWithTheFade) {
  Set first = Example(1);
  first.limit_Nm[0] = 10.0f;
  first.limit_Nm[1] = 4.0f;
  ASSERT_EQ(ff->Offer(first, false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kClamped);
  ASSERT_EQ(tau[0], 10.0f);
  ASSERT_GT(std::abs(Exact(first, 1)), 4.0);
  Set second = first;
  second.generation = 2;
  second.bumpless = true;
  second.blend_ticks = 100;
  second.limit_Nm[0] = 20.0f;
  second.limit_Nm[1] = 3.0f;
  ASSERT_EQ(ff->Offer(second, true), Status::kOk);
  for (int tick = 1; tick <= 110; ++tick) {
    ASSERT_EQ(Evaluate(), Status::kClamped);
    EXPECT_NEAR(tau[0], 10 + std::min(tick, 100) / 10.0, 1e-4);
    EXPECT_NEAR(std::abs(tau[1]), 4 - std::min(tick, 100) / 100.0, 1e-4);
  }
}

// What SPEC promises of any two tables, and of tables that come while a fade is under way: amplitudes far beyond the
// limits, limits and v_min of all sizes with the set-point's speed between them. X is the hardest limit.
TEST_F(FeedForwardTest, HostileTables_AtAnUnchangedSetPoint_MoveTheTorqueByAtMost2XInAFade) {
  std::mt19937 random(3);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const auto size = [&](double low, double high) {
    return static_cast<float>(std::exp(between(std::log(low), std::log(high))));
  };
  constexpr float kX = 300.0f;
  constexpr std::uint32_t kLeast = 50;
  double greatest = 0;
  for (int run = 0; run < 40; ++run) {
    ff = std::make_unique<FeedForward<TwoLink>>();
    Set c = Example(1);
    for (int i = 0; i < 2; ++i) q[i] = size(0.1, 2), qd[i] = size(0.001, 2), qdd[i] = size(0.1, 20);
    for (std::uint32_t adoption = 1; adoption < 12; ++adoption) {
      c.generation = adoption;
      c.bumpless = adoption > 1;
      c.blend_ticks = kLeast + static_cast<std::uint32_t>(between(0, 60));
      for (float& p : c.p) p = size(1e-3, 1e5) * (between(-1, 1) < 0 ? -1 : 1);
      c.eta[0] = size(0.01, 2);
      for (int i = 0; i < 2; ++i) c.limit_Nm[i] = size(1, kX), c.v_min_radps[i] = size(0.001, 2);
      ASSERT_EQ(ff->Offer(c, adoption > 1), Status::kOk);
      float last[2] = {tau[0], tau[1]};
      for (auto ticks = static_cast<int>(between(1, 130)); ticks > 0; --ticks) {
        const Status status = Evaluate();
        ASSERT_TRUE(status == Status::kOk || status == Status::kClamped);
        for (int i = 0; i < 2; ++i) {
          ASSERT_LE(std::abs(tau[i]), kX);
          if (adoption > 1) greatest = std::max(greatest, std::abs(static_cast<double>(tau[i]) - last[i]));
          last[i] = tau[i];
        }
      }
    }
  }
  const double most = 2.0 * kX / kLeast;
  EXPECT_LE(greatest, most * (1 + 1e-4));
  EXPECT_GT(greatest, 0.5 * most) << "the tables were not hostile";
}

TEST_F(FeedForwardTest, EachColumn_AddsItsOwnTorque) {
  for (int k = 0; k < TwoLink::kColumns; ++k) {
    Set c = Example(static_cast<std::uint32_t>(k) + 1);
    for (float& p : c.p) p = 0.0f;
    c.p[k] = 1.0f;
    c.eta[0] = 2.0f;  // so wide that the Stribeck column counts at this speed
    ASSERT_EQ(ff->Offer(c, false), Status::kOk);
    ASSERT_EQ(Evaluate(), Status::kOk);
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(tau[i], Exact(c, i), 1e-5) << k;
    EXPECT_NE(std::abs(tau[0]) + std::abs(tau[1]), 0.0f) << k;
  }
}

TEST_F(FeedForwardTest, NextTable_BringsItsLimitsInTheSameTick) {
  ASSERT_EQ(ff->Offer(Example(1), false), Status::kOk);
  ASSERT_EQ(Evaluate(), Status::kOk);
  Set c = Example(2);
  c.limit_Nm[0] = 10.0f;
  ASSERT_EQ(ff->Offer(c, false), Status::kOk);
  EXPECT_EQ(Evaluate(), Status::kClamped);
  EXPECT_EQ(tau[0], 10.0f);
}

TEST_F(FeedForwardTest, ModelTorque_IsTheSameSumUnclamped) {
  Set c = Example(1);
  c.limit_Nm[0] = 1.0f;
  model::Rows<TwoLink> rows;
  model::Memory<TwoLink> memory;
  float model_tau[2];
  const model::ModelInput<float, 2> x{{q[0], q[1]}, {qd[0], qd[1]}, {qdd[0], qdd[1]}, {30, 30}, 0, 0};
  model::ModelTorque(c, x, memory, rows, model_tau);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(model_tau[i], Exact(c, i), 1e-5 * 50);
}

}  // namespace
}  // namespace armcal::feedforward
