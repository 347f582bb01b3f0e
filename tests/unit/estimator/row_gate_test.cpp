// estimator - the gate of rows: what it refuses, what it lets in, and after how long.
#include "armcal/estimator/row_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {

// Rows of unit noise over a residual that moves slowly, as wrong parameters make it; the read-out explains it.
struct GateTest : testing::Test {
  std::mt19937 random{5};
  std::normal_distribution<float> normal;
  RowGate<1> gate;
  int k = 0;

  float Slow() const { return 30.0f * std::sin(0.01f * static_cast<float>(k)); }
  bool Row(float wrong, float unexplained = 0.0f, bool moves = true) {
    ++k;
    const float noise = normal(random);
    return gate.Admit(0, Slow() + noise + wrong + unexplained, noise + wrong + unexplained, moves, true, kGateSigma);
  }
  void Warm(int rows) {
    for (int i = 0; i < rows; ++i) ASSERT_TRUE(Row(0));
  }
};

TEST_F(GateTest, CleanRows_AreAllTaken) { Warm(20000); }

TEST_F(GateTest, WrongRow_IsRefused_AndTheNextOneIsTaken) {
  Warm(2000);
  for (const float wrong : {-1e6f, -9.0f, 9.0f, 200.0f, 3e38f}) {
    EXPECT_FALSE(Row(wrong)) << wrong;
    EXPECT_TRUE(Row(0)) << wrong;
  }
}

// With an unknown arm the innovation is as large as the residual: only the change tells.
TEST_F(GateTest, WrongRowBeforeAnythingIsKnown_IsRefusedByItsChange) {
  for (; k < 60;) ASSERT_TRUE(Row(0, Slow()));
  EXPECT_FALSE(Row(12, Slow()));
  EXPECT_TRUE(Row(0, Slow()));
}

// Five wrong rows of a hundred and twenty-five, which is what one wrong count makes, a minute long.
TEST_F(GateTest, WrongRowsEverySecond_AreRefusedForEver) {
  Warm(500);
  int refused = 0, lost = 0;
  for (int i = 0; i < 7500; ++i) {
    const bool wrong = i % 125 < 5;
    const bool taken = Row(wrong ? 100.0f : 0.0f);
    (wrong ? refused : lost) += !taken;
  }
  EXPECT_EQ(refused, 300);
  EXPECT_LE(lost, 7);  // 0.1 per cent
}

// A changed arm: rows are off by the same from now on, until the read-out has followed.
TEST_F(GateTest, ChangedArm_IsLetInAfterAnEighthOfASecond) {
  Warm(2000);
  int row = 0;
  while (!Row(0, 20.0f) && row < 1000) ++row;
  EXPECT_EQ(row, 16);
  int refused = 0;
  for (int i = 0; i < 500; ++i) refused += !Row(0, 20.0f);
  EXPECT_EQ(refused, 0);
}

TEST_F(GateTest, ChangeOfTwentyTimesTheNoise_RightAfterABurstOfWrongRows_IsLetIn) {
  Warm(2000);
  for (int i = 0; i < 30; ++i) Row(i % 2 == 0 ? 500.0f : -500.0f);
  int row = 0;
  while (!Row(0, 20.0f) && row < 1000) ++row;
  EXPECT_LE(row, 32);
}

// Rows at rest say nothing, and the first one after them follows none: friction has turned meanwhile.
TEST_F(GateTest, RowAfterARest_IsNotComparedWithTheOneBefore) {
  Warm(2000);
  for (int i = 0; i < 20; ++i) Row(1000, 0, false);
  EXPECT_TRUE(gate.Admit(0, 500.0f, 0.5f, true, true, kGateSigma));
  EXPECT_FALSE(gate.Admit(0, 550.0f, 0.5f, true, true, kGateSigma));
}

TEST_F(GateTest, RowAfterATurn_IsNotComparedWithTheOneBefore) {
  Warm(2000);
  EXPECT_TRUE(gate.Admit(0, 500.0f, 0.5f, true, false, kGateSigma));
  EXPECT_FALSE(gate.Admit(0, 550.0f, 0.5f, true, false, kGateSigma));
}

TEST_F(GateTest, OpenGate_TakesEveryRow) {
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(gate.Admit(0, i % 7 == 0 ? 1e9f : 0.0f, 1e9f, true, true, 0.0f));
}

TEST_F(GateTest, RowThatIsNotANumber_IsRefusedAndSpoilsNothing) {
  Warm(2000);
  EXPECT_FALSE(Row(NAN));
  Warm(2000);
  EXPECT_FALSE(Row(20));
}

TEST(RowGate, Joints_DoNotShareTheirSpreads) {
  RowGate<2> gate;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  for (int k = 0; k < 2000; ++k) {
    const float a = normal(random), b = 50 * normal(random);
    (void)gate.Admit(0, a, a, true, true, kGateSigma);
    (void)gate.Admit(1, b, b, true, true, kGateSigma);
  }
  EXPECT_FALSE(gate.Admit(0, 20.0f, 20.0f, true, true, kGateSigma));
  EXPECT_TRUE(gate.Admit(1, 20.0f, 20.0f, true, true, kGateSigma));
}

// A torque that is wrong in one sample leaves every bit of the estimate, and the joint's other rows are worked in.
template <class Filter>
void OneWrongTorque() {
  const auto rigid = std::make_unique<physical::RigidPrior<test::TwoLink, float>>();
  const auto table = std::make_unique<AdoptedTable<test::TwoLink>>();
  ASSERT_EQ(BuildAdoptedTable<test::TwoLink>(DefaultTable<test::TwoLink>(), 1, *rigid, *table), core::Status::kOk);
  Estimates<test::TwoLink> end[2];
  for (int wrong = 0; wrong < 2; ++wrong) {
    const auto arm = std::make_unique<Estimator<test::TwoLink, Filter>>();
    arm->Adopt(*table, 0);
    test::Motion motion;
    for (int k = 0; k < 1000; ++k) {
      auto sample = motion.Next();
      if (k == 700 && wrong == 0) sample.flags[1] = 0;  // what the same run does without that row
      if (k == 700 && wrong == 1) sample.tau[1] += 40;
      ASSERT_EQ(arm->PushSample(sample), core::Status::kOk);
      while (arm->Step()) {
      }
    }
    arm->RequestReadOut();
    while (arm->Step()) {
    }
    ASSERT_TRUE(arm->Take(end[wrong]));
  }
  EXPECT_EQ(end[1].rows_outside[0], 0u);
  EXPECT_EQ(end[1].rows_outside[1], 1u);
  EXPECT_EQ(end[0].rows_outside[1], 0u);
  EXPECT_EQ(end[1].rows_used[1], end[0].rows_used[1]);
  for (int k = 0; k < test::kColumns; ++k) EXPECT_EQ(end[0].value[k], end[1].value[k]) << k;
}
TEST(RowGate, WrongTorque_IsAsARowThatIsNotThere_InEveryFilter) {
  OneWrongTorque<filter::ForgettingFilter<test::TwoLink>>();
  OneWrongTorque<filter::KalmanFilter<test::TwoLink>>();
  OneWrongTorque<filter::ExtendedKalmanFilter<test::TwoLink>>();
}

}  // namespace
}  // namespace armcal::estimator
