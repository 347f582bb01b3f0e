// estimator - what a decoded table becomes when it is adopted.
#include "armcal/estimator/adopted_table.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal::estimator {
namespace {
using armcal::test::TwoLink;
using core::Status;
using model::ParameterState;

constexpr int kFrontEntry = TwoLink::kBodyParameters;

struct AdoptedTableTest : testing::Test {
  Table<TwoLink> table = DefaultTable<TwoLink>();
  std::unique_ptr<physical::RigidPrior<TwoLink, float>> rigid =
      std::make_unique<physical::RigidPrior<TwoLink, float>>();
  std::unique_ptr<AdoptedTable<TwoLink>> adopted = std::make_unique<AdoptedTable<TwoLink>>();
  Status Build(std::uint32_t generation = 1) { return BuildAdoptedTable<TwoLink>(table, generation, *rigid, *adopted); }
  // Variance of a rigid column in its own unit.
  float Sd(int r) const { return adopted->scale[TwoLink::kFront + r]; }
};

TEST_F(AdoptedTableTest, DefaultTable_MapsBodiesAndSpreadsByHand) {
  table.flags = model::kFlagBumpless;
  table.blend_ms = 200;
  ASSERT_EQ(Build(7), Status::kOk);
  const auto& c = adopted->committed;
  EXPECT_TRUE(c.valid && c.bumpless);
  EXPECT_EQ(c.generation, 7u);
  EXPECT_EQ(c.blend_ticks, 200u);
  EXPECT_NEAR(c.p[TwoLink::kFront + 0], 0.704 + 0.8 + 0.25 * 5, 1e-6);
  EXPECT_NEAR(c.p[TwoLink::kFront + 1], 2 + 0.5 * 5, 1e-6);
  EXPECT_EQ(c.p[0], 8.0f);
  EXPECT_EQ(c.eta[0], 0.1f);
  EXPECT_EQ(c.limit_Nm[1], 80.0f);
  EXPECT_EQ(adopted->sigma_Nm[0], 0.5f);
  // MY1 = m1 c1y: var = c^2 var(m) + m^2 var(c), c = 0.02, m = 10, sd 2 and 0.01.
  EXPECT_NEAR(Sd(2), std::sqrt(0.02 * 0.02 * 4 + 100 * 1e-4), 1e-6);
  // MX1 + a1 m2: m1 c1x (c = 0.2) and half of m2.
  EXPECT_NEAR(Sd(1), std::sqrt(0.2 * 0.2 * 4 + 100 * 0.0016 + 0.25 * 1), 1e-6);
  EXPECT_NEAR(Sd(6), 0.06, 1e-7);
  EXPECT_EQ(adopted->scale[0], 4.0f);
}

// 2^32 - 256 is the largest float that still fits: 49 days of ticks.
TEST_F(AdoptedTableTest, FadeOfMoreTicksThanACounterHolds_IsCut) {
  table.blend_ms = 0xFFFFFFFFu;
  ASSERT_EQ(Build(), Status::kOk);
  EXPECT_EQ(adopted->committed.blend_ticks, 0xFFFFFF00u);
}

TEST_F(AdoptedTableTest, RigidColumns_AreCorrelatedThroughTheSharedMass) {
  ASSERT_EQ(Build(), Status::kOk);
  // cov(MX1 + a1 m2, MX2) = a1 c2x var(m2) = 0.5 * 0.2 * 1.
  float covariance = 0;
  const float* ud = adopted->prior.dense_ud;
  const auto u = [&](int i, int j) { return i == j ? 1.0f : i < j ? ud[math::UdIndex(i, j)] : 0.0f; };
  for (int k = 0; k < TwoLink::kDense; ++k) covariance += u(1, k) * ud[math::UdIndex(k, k)] * u(3, k);
  EXPECT_NEAR(covariance * Sd(1) * Sd(3), 0.1, 1e-6);
  float diagonal[TwoLink::kDense];
  math::UdDiagonal<TwoLink::kDense>(ud, diagonal);
  for (int k = 0; k < TwoLink::kRigid; ++k) EXPECT_NEAR(diagonal[k], 1, 1e-5);
  EXPECT_EQ(diagonal[TwoLink::kRigid], 0.0f);  // the coupling effect is in standby
}

TEST_F(AdoptedTableTest, States_DecideAmplitudeAndActivity) {
  table.parameter[kFrontEntry + 0].state = ParameterState::kFixed;       // Fc1
  table.parameter[kFrontEntry + 1].state = ParameterState::kConsidered;  // Fv1
  table.parameter[kFrontEntry + 2].state = ParameterState::kEstimated;   // To1
  table.parameter[kFrontEntry + 3].state = ParameterState::kStandby;     // Fc2
  table.parameter[kFrontEntry + 7].state = ParameterState::kEstimated;   // coupling
  ASSERT_EQ(Build(), Status::kOk);
  const auto& p = adopted->prior;
  EXPECT_EQ(adopted->committed.p[0], 8.0f);
  EXPECT_EQ(p.active[0], 0u);
  EXPECT_EQ(p.active[1], ~0u);
  EXPECT_TRUE(p.considered[1] && p.any_considered);
  EXPECT_EQ(p.noise[1], 0.0f);  // what is not updated gets no noise either
  EXPECT_EQ(p.active[2], ~0u);
  EXPECT_EQ(adopted->committed.p[3], 0.0f);
  EXPECT_EQ(p.active[3], 0u);
  EXPECT_EQ(p.active[TwoLink::kColumns - 1], ~0u);
  EXPECT_EQ(p.dense_ud[math::UdIndex(7, 7)], 1.0f);
  EXPECT_NEAR(p.noise[4], 1e-6 / 1.0, 1e-12);  // Fv2: in prior units
}

TEST_F(AdoptedTableTest, ProcessNoise_IsTheTablesVarianceInPriorUnits) {
  table.parameter[kFrontEntry].sd = 4.0f;  // Fc1
  table.parameter[kFrontEntry].process_noise = 0.32f;
  ASSERT_EQ(Build(), Status::kOk);
  EXPECT_FLOAT_EQ(adopted->prior.noise[0], 0.02f);  // 0.32 / 4^2
}

TEST_F(AdoptedTableTest, RigidColumn_IsConsideredOnlyIfAllBehindItAre) {
  table.parameter[21].state = ParameterState::kConsidered;  // rotor2 is a column of its own
  table.parameter[12].state = ParameterState::kConsidered;  // c2x alone is not: m2 moves MX2, too
  ASSERT_EQ(Build(), Status::kOk);
  EXPECT_TRUE(adopted->prior.considered[TwoLink::kFront + 6]);
  EXPECT_FALSE(adopted->prior.considered[TwoLink::kFront + 3]);
}

TEST_F(AdoptedTableTest, FixedBodies_LeaveTheirColumnsInactive) {
  for (int k = 0; k < TwoLink::kBodyParameters; ++k) table.parameter[k].state = ParameterState::kFixed;
  ASSERT_EQ(Build(), Status::kOk);
  for (int k = TwoLink::kFront; k < TwoLink::kColumns; ++k) {
    EXPECT_EQ(adopted->prior.active[k], 0u);
    EXPECT_EQ(adopted->scale[k], 0.0f);
  }
  EXPECT_NEAR(adopted->committed.p[TwoLink::kFront + 1], 4.5, 1e-6);
}

TEST_F(AdoptedTableTest, ForgettingGroups_ReachTheirColumns) {
  table.forgetting[0] = 0.999f;
  table.forgetting[1] = 0.99f;
  ASSERT_EQ(Build(), Status::kOk);
  EXPECT_EQ(adopted->prior.lambda[0], 0.99f);
  EXPECT_EQ(adopted->prior.lambda[2], 1.0f);
  EXPECT_EQ(adopted->prior.lambda[TwoLink::kFront], 0.999f);
}

TEST_F(AdoptedTableTest, Refusal_LeavesItByteForByte) {
  ASSERT_EQ(Build(), Status::kOk);
  std::vector<unsigned char> before(sizeof *adopted), after(sizeof *adopted);
  std::memcpy(before.data(), adopted.get(), sizeof *adopted);
  const Table<TwoLink> good = table;

  table.schema ^= 1;
  EXPECT_EQ(Build(), Status::kWrongSchema);
  table = good;
  table.parameter[11].mean = -5.0f;
  EXPECT_EQ(Build(), Status::kUnphysical);
  table = good;
  table.parameter[9].mean *= 3;  // the triangle inequality breaks
  EXPECT_EQ(Build(), Status::kUnphysical);
  table = good;
  table.parameter[10].mean = -0.1f;
  EXPECT_EQ(Build(), Status::kUnphysical);
  table = good;
  table.parameter[4].state = ParameterState::kStandby;  // off: a body without its inertia about x
  EXPECT_EQ(Build(), Status::kUnphysical);
  table = good;
  table.parameter[11].sd = 1e30f;
  EXPECT_EQ(Build(), Status::kNotFinite);
  std::memcpy(after.data(), adopted.get(), sizeof *adopted);
  EXPECT_EQ(before, after);
}

}  // namespace
}  // namespace armcal::estimator
