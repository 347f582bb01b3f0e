// controller - the grid of friction, on a joint whose friction has each dependence that a real one may have.
#include "armcal/model/friction_grid.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

namespace armcal::friction_grid {
namespace {

using core::Status;

// One joint: Coulomb, viscous, |speed| (asymmetry), Coulomb by temperature, Coulomb by load, an offset that is no
// friction, and friction with memory.
struct Joint {
  static constexpr int kJoints = 1, kFront = 7, kDense = 1, kColumns = 8, kNonlinear = 0, kStates = 1;
  static constexpr int kBodyParameters = 11;
  static constexpr int kFrontBegin[2] = {0, 7};
  static constexpr bool kFriction[7] = {true, true, true, true, true, false, true};
  static constexpr unsigned kFrictionReads = model::kReadsPose | model::kReadsTemperature | model::kReadsHistory;

  template <class T>
  static void InitialState(const model::ModelInput<T, 1>&, const T*, const T*, T* state) {
    state[0] = 0;
  }
  // Memory: Dahl's z, with a length of 0.01 rad.
  template <class T>
  static void Regressor(const model::ModelInput<T, 1>& x, const T*, const T*, const T* state, T* next, T* front,
                        T* dense) {
    const T sign = x.qd[0] > 0 ? T(1) : x.qd[0] < 0 ? T(-1) : T(0);
    next[0] = sign + (state[0] - sign) * std::exp(-std::abs(x.qd[0]) * x.dt / T(0.01));
    front[0] = sign;
    front[1] = x.qd[0];
    front[2] = std::abs(x.qd[0]);
    front[3] = (x.temp[0] - 30) * sign;
    front[4] = std::abs(10 * std::sin(x.q[0])) * sign;
    front[5] = 1;
    front[6] = next[0];
    dense[0] = 0;
  }
};

constexpr model::Ceilings<1, 18> kCeilings = {
    {500, 1000000, 0.9f, 10, 50}, {{100, 80, 2, 0.5f, 2, 1e-4f, 100, 1e-4f, 3, 3, -2, 2}}, {}};

core::Refusal Judge(std::initializer_list<float> coefficients) {
  model::Committed<Joint> committed;
  int k = 0;
  for (const float c : coefficients) committed.p[k++] = c;
  model::Memory<Joint> memory;
  model::Rows<Joint> rows;
  return model::CheckFriction(committed, model::View(kCeilings), memory, rows);
}
int WordOfColumn(int column) { return 16 + 8 + 8 * (11 + column); }

// Each case lies on one side of a bound that follows from the formulas above: at most 2 N m may push, 80 N m brake.
TEST(FrictionGrid, ASumThatBrakes_IsAccepted) {
  EXPECT_EQ(Judge({20, 5}).status, Status::kOk);
  EXPECT_EQ(Judge({20, -5}).status, Status::kOk) << "rises less than in proportion";
  EXPECT_EQ(Judge({20, 5, -5}).status, Status::kOk) << "differs between the directions";
  EXPECT_EQ(Judge({20, 5, 5}).status, Status::kOk);
  EXPECT_EQ(Judge({20, 0, 0, -0.9f}).status, Status::kOk) << "falls with temperature";
  EXPECT_EQ(Judge({20, 0, 0, 0.9f}).status, Status::kOk) << "rises with temperature";
  EXPECT_EQ(Judge({20, 0, 0, 0, -1.5f}).status, Status::kOk) << "falls with load";
  EXPECT_EQ(Judge({0, 0, 0, 0, 0, -90}).status, Status::kOk) << "an offset is no friction";
  EXPECT_EQ(Judge({0, 0, 0, 0, 0, 0, 20}).status, Status::kOk) << "has memory";
  EXPECT_EQ(Judge({-15, 0, 0, 0, 0, 0, 20}).status, Status::kOk);
}

TEST(FrictionGrid, ASumThatPushesAnywhere_IsRefused) {
  EXPECT_EQ(Judge({20, -7.5f}).status, Status::kFeedsEnergy) << "at the highest speed";
  EXPECT_EQ(Judge({-3, 50}).status, Status::kFeedsEnergy) << "at the lowest speed";
  EXPECT_EQ(Judge({5, 0, 3}).status, Status::kFeedsEnergy) << "backward";
  EXPECT_EQ(Judge({5, 0, -3}).status, Status::kFeedsEnergy) << "forward";
  EXPECT_EQ(Judge({20, 0, 0, -1.2f}).status, Status::kFeedsEnergy) << "warm";
  EXPECT_EQ(Judge({20, 0, 0, 1.2f}).status, Status::kFeedsEnergy) << "cold";
  EXPECT_EQ(Judge({5, 0, 0, 0, -1.5f}).status, Status::kFeedsEnergy) << "under load";
  EXPECT_EQ(Judge({0, 0, 0, 0, 0, 0, -5}).status, Status::kFeedsEnergy) << "with memory";
  const core::Refusal refusal = Judge({20, -9});
  EXPECT_NEAR(refusal.value, 20 - 27, 0.01f);
  EXPECT_EQ(refusal.bound, -2.0f);
  EXPECT_EQ(refusal.word, WordOfColumn(1)) << "the column with the greatest part";
}

TEST(FrictionGrid, MoreThanTheHardestFriction_IsRefused) {
  EXPECT_EQ(Judge({79}).status, Status::kOk);
  EXPECT_EQ(Judge({81}).status, Status::kBeyondCeiling);
  EXPECT_EQ(Judge({40, 14}).status, Status::kBeyondCeiling);
  EXPECT_EQ(Judge({40, 0, 0, 2.1f}).status, Status::kBeyondCeiling);
  EXPECT_EQ(Judge({INFINITY}).status, Status::kNotFinite);
}

// Each combination is tried, and no point twice.
TEST(FrictionGrid, Points_AreAllDifferent) {
  for (unsigned reads = 0; reads < 4; ++reads) {
    std::set<std::array<float, 3>> seen;
    for (int k = 0; k < model::GridPoints(reads); ++k) {
      float q, qd, temp;
      model::GridState(model::View(kCeilings), reads, k, &q, &qd, &temp);
      EXPECT_TRUE(q >= -2 && q <= 2 && std::abs(qd) <= 3 && temp >= 10 && temp <= 50);
      seen.insert({q, qd, temp});
    }
    EXPECT_EQ(static_cast<int>(seen.size()), model::GridPoints(reads)) << reads;
    EXPECT_EQ(seen.size(), 16u * (reads & model::kReadsPose ? 4u : 1u) * (reads & model::kReadsTemperature ? 3u : 1u));
  }
}

}  // namespace
}  // namespace armcal::friction_grid
