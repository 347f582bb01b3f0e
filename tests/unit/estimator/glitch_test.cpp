// estimator - wrong readings that no bus has flagged, on every filter: against the run in which the same ticks are
// flagged; and changes of the arm, which must come through.
#include "tests/unit/estimator/glitches.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests

TYPED_TEST_SUITE(GlitchTest, GlitchFilters);

TYPED_TEST(GlitchTest, WrongReadings_LeaveEstimatesWhereFlaggedOnesLeaveThem) {
  for (const Glitch& glitch : Battery()) {
    Pair pair(21, CleanTicks());
    glitch.plant(pair);
    this->Compare(glitch.name, pair);
  }
}

// With time stamps, ticks that come early or late are as good as exact ones. long_glitch_test.cpp has the whole
// battery.
TYPED_TEST(GlitchTest, JitteredTicksWithStamps_LeaveEstimatesWhereExactTicksLeaveThem) {
  this->Compare("jitter", Pair(21, JitteredTicks()));
  EXPECT_EQ(this->arm->implausible(), 0u);
}
TYPED_TEST(GlitchTest, ExactTicksWithStamps_HaveTheBitsOfTicksWithout) {
  const auto with = this->Run(MakeTicks(0, true)), without = this->Run(CleanTicks());
  ASSERT_EQ(with.size(), without.size());
  EXPECT_EQ(std::memcmp(with.back().value, without.back().value, sizeof with.back().value), 0);
  EXPECT_EQ(std::memcmp(with.back().sd, without.back().sd, sizeof with.back().sd), 0);
}

// All gates on: nothing is refused of a clean run, and so every bit is that of open gates.
TYPED_TEST(GlitchTest, CleanRun_HasTheBitsOfOpenGates) {
  const auto gated = this->Run(CleanTicks());
  EXPECT_EQ(this->arm->implausible(), 0u);
  for (float& gate : this->table->gate_sigma) gate = 0.0f;
  const auto open = this->Run(CleanTicks());
  ASSERT_EQ(gated.size(), open.size());
  double used = 0, outside = 0;
  for (int i = 0; i < 6; ++i) used += open.back().rows_used[i], outside += gated.back().rows_outside[i];
  EXPECT_LE(outside, 0.001 * used);
  EXPECT_GT(used, 10000);
  if (outside > 0) return;
  EXPECT_EQ(std::memcmp(gated.back().value, open.back().value, sizeof open.back().value), 0);
  EXPECT_EQ(std::memcmp(gated.back().sd, open.back().sd, sizeof open.back().sd), 0);
}

// Seconds after a change of joint 2's friction by half until its estimate is within 10 %, with and without the gate.
template <class Filter>
double FollowsIn(bool gate, float forgetting) {
  auto entries = DefaultTable<Model>();
  for (float& f : entries.forgetting) f = forgetting;
  const auto rigid = std::make_unique<physical::RigidPrior<Model, float>>();
  const auto table = std::make_unique<AdoptedTable<Model>>();
  EXPECT_EQ(BuildAdoptedTable<Model>(entries, 1, *rigid, *table), core::Status::kOk);
  if (!gate)
    for (float& g : table->gate_sigma) g = 0.0f;
  const auto estimator = std::make_unique<Estimator<Model, Filter>>();
  estimator->SetPublishEvery(25);
  estimator->Adopt(*table, 0);
  MovingArm<Model> arm;
  Estimates<Model> now;
  const int column = Model::kFrontBegin[1];
  int changed = 0;
  for (int k = 0; k < 30000; ++k) {
    if (k == 5000) arm.truth(column) *= 1.5, changed = k;
    EXPECT_EQ(estimator->PushSample(arm.Next()), core::Status::kOk);
    while (estimator->Step()) {
    }
    if (!estimator->Take(now) || changed == 0) continue;
    if (std::abs(now.value[column] - arm.truth(column)) < 0.1 * arm.truth(column)) return 0.008 * (k - changed);
  }
  return 1e9;
}
TEST(Change, FrictionThatGrowsByHalf_IsFollowedAsFastAsWithoutAGate) {
  const double open = FollowsIn<filter::ForgettingFilter<Model>>(false, 0.999f),
               gated = FollowsIn<filter::ForgettingFilter<Model>>(true, 0.999f);
  EXPECT_LT(open, 60);
  EXPECT_LE(gated, 1.2 * open);
}

}  // namespace
}  // namespace armcal::estimator
