// controller - the grid of friction, on a joint whose friction has each dependence that a real one may have.
#include "armcal/model/friction_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

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

// Each combination is tried, and no point twice. With pose: four poses at eight speeds, then 53 and eight between two
// nonlinear parameters, at two speeds.
TEST(FrictionGrid, Points_AreAllDifferent) {
  const float eta[] = {-1.0f, 0.5f};
  for (unsigned reads = 0; reads < 4; ++reads) {
    std::set<std::array<float, 3>> seen;
    for (int k = 0; k < model::GridPoints(reads, 2); ++k) {
      float q, qd, temp;
      model::GridState(model::View(kCeilings), reads, k, eta, &q, &qd, &temp);
      EXPECT_TRUE(q >= -2 && q <= 2 && std::abs(qd) <= 3 && temp >= 10 && temp <= 50);
      seen.insert({q, qd, temp});
    }
    EXPECT_EQ(static_cast<int>(seen.size()), model::GridPoints(reads, 2)) << reads;
    const unsigned at_one_temperature = reads & model::kReadsPose ? 2 * (8 * 4 + 2 * (53 + 8)) : 2 * 8;
    EXPECT_EQ(seen.size(), at_one_temperature * (reads & model::kReadsTemperature ? 3u : 1u)) << reads;
  }
}

// Of an arm with joints that all go from 0 to 1: no joint is left out of a part of its range, and no two move alike.
TEST(FrictionGrid, EachJointVisitsItsWholeRange) {
  model::Ceilings<16, 1> c = {{500, 1000000, 0.9f, 10, 50}, {}, {}};
  for (auto& joint : c.joint) joint.position_high_rad = 1, joint.speed_radps = 1;
  const int points = model::GridPoints(model::kReadsPose, 0);
  std::vector<std::array<float, 16>> q(static_cast<std::size_t>(points));
  for (int k = 0; k < points; ++k) {
    float qd[16], temp[16];
    model::GridState(model::View(c), model::kReadsPose, k, static_cast<const float*>(nullptr),
                     q[static_cast<std::size_t>(k)].data(), qd, temp);
  }
  for (std::size_t i = 0; i < 16; ++i) {
    std::set<float> places;
    bool like_another = false;
    for (const auto& at : q) places.insert(at[i]);
    for (std::size_t other = 0; other < i; ++other)
      like_another |= std::all_of(q.begin(), q.end(), [&](const auto& at) { return at[i] == at[other]; });
    EXPECT_FALSE(like_another) << i;
    for (const float share : {0.5f, 0.12f, 0.88f, 0.31f}) EXPECT_TRUE(places.count(share)) << "joint " << i;
    float before = 0;
    for (const float place : places) {
      EXPECT_LT(place - before, 2.01f / 53) << "joint " << i << " at " << place;
      before = place;
    }
    EXPECT_GT(before, 1 - 2.01f / 53);
  }
}

// Friction that depends on the position of the last of four joints: Coulomb 5 N m everywhere, and one more term.
struct Positions {
  static constexpr int kJoints = 4, kFront = 2, kDense = 1, kColumns = 3, kNonlinear = 3, kStates = 0;
  static constexpr int kBodyParameters = 40;
  static constexpr int kFrontBegin[5] = {0, 0, 0, 0, 2};
  static constexpr bool kFriction[2] = {true, true};
  static constexpr unsigned kFrictionReads = model::kReadsPose;
  enum class Term { kWindow, kRipple };
  inline static Term term;

  // eta: a number that is no position, then the window's ends, or the ripple's frequency and phase.
  template <class T>
  static void Regressor(const model::ModelInput<T, 4>& x, const T*, const T* eta, const T*, T*, T* front, T* dense) {
    const T sign = x.qd[3] > 0 ? T(1) : x.qd[3] < 0 ? T(-1) : T(0);
    front[0] = sign;
    front[1] =
        sign * (term == Term::kWindow ? T(x.q[3] > eta[1] && x.q[3] < eta[2]) : std::cos(eta[1] * x.q[3] + eta[2]));
    dense[0] = 0;
  }
};

core::Refusal JudgePositions(Positions::Term term, float coefficient, float first, float second) {
  model::Ceilings<4, 45> c = {{500, 1000000, 0.9f, 10, 50}, {}, {}};
  for (auto& joint : c.joint) joint = {100, 80, 2, 0.5f, 2, 1e-4f, 100, 1e-4f, 3, 3, -2, 3};
  model::Committed<Positions> committed;
  committed.p[0] = 5, committed.p[1] = coefficient;
  committed.eta[0] = 0.07f, committed.eta[1] = first, committed.eta[2] = second;
  Positions::term = term;
  model::Memory<Positions> memory;
  model::Rows<Positions> rows;
  return model::CheckFriction(committed, model::View(c), memory, rows);
}

// However narrow, a part of the range where the friction pushes is found, because the table says where it is.
TEST(FrictionGrid, APushInAWindowOfPositions_IsRefused) {
  for (const float width : {4.0f, 0.3f, 0.01f, 0.001f})
    for (float from = -1.9f; from < 2.9f; from += 0.1f) {
      EXPECT_EQ(JudgePositions(Positions::Term::kWindow, -9, from, from + width).status, Status::kFeedsEnergy)
          << from << " " << width;
      EXPECT_EQ(JudgePositions(Positions::Term::kWindow, -4, from, from + width).status, Status::kOk);
    }
}

// Whatever the frequency, a ripple that pushes for a good part of its period does so at some point of the sweep.
TEST(FrictionGrid, APushOfARipple_IsRefusedAtAnyFrequency) {
  for (float k = 4; k < 400; k *= 1.003f)
    for (const float phase : {0.0f, 2.0f, 4.0f}) {
      EXPECT_EQ(JudgePositions(Positions::Term::kRipple, 12, k, phase).status, Status::kFeedsEnergy)
          << k << " " << phase;
      EXPECT_EQ(JudgePositions(Positions::Term::kRipple, 4, k, phase).status, Status::kOk) << k;
    }
}

}  // namespace
}  // namespace armcal::friction_grid
