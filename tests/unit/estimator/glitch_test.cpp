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

// A change of the arm, and what the filter is told of changes.
struct ArmChange {
  bool payload;      // 2 kg at the last link; else joint 2's friction grows by half
  float forgetting;  // a sample
  float noise;       // process noise, times the table's own
  bool burst;        // every third row of the last 0.8 s before it is wrong
};

// Samples after the change until the parameter that it changes most is within 10 % of its new value.
template <class Filter>
int FollowsIn(const ArmChange& change, bool gate) {
  auto entries = DefaultTable<Model>();
  for (float& f : entries.forgetting) f = change.forgetting;
  for (auto& entry : entries.parameter) entry.process_noise *= change.noise;
  const auto rigid = std::make_unique<physical::RigidPrior<Model, float>>();
  const auto table = std::make_unique<AdoptedTable<Model>>();
  EXPECT_EQ(BuildAdoptedTable<Model>(entries, 1, *rigid, *table), core::Status::kOk);
  if (!gate)
    for (float& g : table->gate_sigma) g = 0.0f;
  const auto estimator = std::make_unique<Estimator<Model, Filter>>();
  estimator->SetPublishEvery(25);
  estimator->Adopt(*table, 0);
  MovingArm<Model> arm;
  std::mt19937 random(5);
  Estimates<Model> now;
  constexpr int kChange = 5000, kBurst = 100, kMost = 8000;
  int column = Model::kFrontBegin[1];
  for (int k = 0; k < kChange + kMost; ++k) {
    if (k == kChange && !change.payload) arm.truth(column) *= 1.5;
    if (k == kChange && change.payload) {
      const Vector before = arm.truth;
      arm.PickUp(2);
      double most = 0;
      for (int c = Model::kFront; c < Model::kColumns; ++c) {
        if (!(now.sd[c] < 0.2f * table->scale[c])) continue;  // the prior says more of it than the data
        const double moved = std::abs(arm.truth(c) - before(c)) / now.sd[c];
        if (moved > most) most = moved, column = c;
      }
    }
    auto sample = arm.Next();
    if (change.burst && gate && k < kChange && k >= kChange - kBurst && k % 3 == 0)
      for (int i = 0; i < 6; ++i) sample.tau[i] += (random() % 2 != 0 ? 100 : -100) * Model::kAxes[i].sigma_Nm;
    EXPECT_EQ(estimator->PushSample(sample), core::Status::kOk);
    while (estimator->Step()) {
    }
    if (!estimator->Take(now) || k < kChange) continue;
    if (std::abs(now.value[column] - arm.truth(column)) < 0.1 * std::abs(arm.truth(column))) return k - kChange;
  }
  return 100 * kMost;
}
template <class Filter>
void ExpectToFollow(const ArmChange& change) {
  const int open = FollowsIn<Filter>(change, false), gated = FollowsIn<Filter>(change, true);
  EXPECT_LT(open, 8000) << "a test of nothing";
  EXPECT_LE(10 * gated, 12 * open) << (change.payload ? "payload" : "friction")
                                   << (change.burst ? " after a burst" : "") << ", process noise times "
                                   << change.noise;
}

TEST(Change, IsFollowedAsFastAsWithoutAGate_ByTheForgettingForm) {
  for (const bool payload : {false, true})
    for (const bool burst : {false, true}) ExpectToFollow<filter::ForgettingFilter<Model>>({payload, 0.999f, 1, burst});
}
TEST(Change, OfFriction_IsFollowedAsFastAsWithoutAGate_ByTheKalmanForms) {
  for (const float noise : {1.0f, 10.0f, 100.0f})
    for (const bool burst : {false, true}) {
      ExpectToFollow<filter::KalmanFilter<Model>>({false, 1, noise, burst});
      ExpectToFollow<filter::KalmanFilter<Model, filter::Form::kBlock>>({false, 1, noise, burst});
      ExpectToFollow<filter::ExtendedKalmanFilter<Model>>({false, 1, noise, burst});
      ExpectToFollow<filter::ModelBank<Model>>({false, 1, noise, burst});
    }
}

}  // namespace
}  // namespace armcal::estimator
