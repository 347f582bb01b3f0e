// filter - the forgetting form against re-triangularised double QR.
#include "armcal/filter/forgetting_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <type_traits>

#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/filter/moving_joints.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

using SmallForgetting = ForgettingFilter<Small>;

// Every bit that the filter keeps from row to row.
std::vector<float> Kept(const SmallForgetting& filter) {
  std::vector<float> all(filter.weights(), filter.weights() + Small::kColumns);
  all.insert(all.end(), filter.triangle(), filter.triangle() + SmallForgetting::kTriangle);
  return all;
}

// The recursion [sqrt(lambda) R; rows] in double by Householder QR. Rows of R belong to columns because the column
// order is the filter's, so the same blocks can forget under the same gates.
struct Recursion {
  Matrix r = Matrix::Zero(Small::kColumns, Small::kColumns + 1);
  void Add(const Matrix& rows) {
    Matrix a(Small::kColumns + rows.rows(), Small::kColumns + 1);
    a << r, rows;
    const Eigen::HouseholderQR<Matrix> qr(a);
    r = qr.matrixQR().topRows(Small::kColumns).triangularView<Eigen::Upper>();
  }
  void Forget(const Prior<Small>& prior, std::uint32_t moving) {
    for (int k = 0; k < Small::kColumns; ++k) {
      const std::uint32_t needed = JointsOf<Small>(k);
      if ((moving & needed) == needed) r.row(k) *= std::sqrt(static_cast<double>(prior.lambda[k]));
    }
  }
  Posterior Solve(const Prior<Small>& prior) const {
    return SolveBatch(PriorCovariance(prior), r.leftCols(Small::kColumns), r.col(Small::kColumns));
  }
};
Matrix Augmented(const Row& row) {
  Matrix a(1, Small::kColumns + 1);
  a << Full<Small>(row).transpose(), row.y;
  return a;
}

TEST(ForgettingFilter, LambdaOne_IsTheBatchSolution_AndTheKalmanForm) {
  Bench bench;
  bench.size = 3;
  SmallForgetting filter;
  KalmanFilter<Small> kalman;
  filter.Restart(bench.prior);
  kalman.Restart(bench.prior);
  const std::vector<Row> rows = bench.Rows(2000);
  for (const Row& r : rows) {
    EXPECT_TRUE(filter.Update(r.joint, r.front, r.dense, r.y, true).accepted);
    EXPECT_TRUE(kalman.Update(r.joint, r.front, r.dense, r.y, true).accepted);
  }
  const Posterior oracle = SolveBatch(bench.prior, rows);
  const SmallForgetting::ReadOut out = Read(filter);
  EXPECT_LT(Distance<Small>(out.x, oracle), 0.01);
  const auto other = Read(kalman);
  for (int k = 0; k < Small::kColumns; ++k) {
    EXPECT_NEAR(out.sd[k] / oracle.sd(k), 1, 1e-3);
    EXPECT_NEAR((out.x[k] - other.x[k]) / oracle.sd(k), 0, 0.01);
  }
}

TEST(ForgettingFilter, GatedForgetting_IsTheGatedQrRecursion) {
  Bench bench;
  bench.size = 2;
  for (int k = 0; k < Small::kColumns; ++k) bench.prior.lambda[k] = k < Small::kFront ? 0.99f : 0.997f;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  Recursion recursion;
  for (int s = 0; s < 3000; ++s) {
    const std::uint32_t moving = s / 200 % 4 == 3 ? s / 800 % 7 : kAll;  // now and then some joints rest
    if (s == 1500) bench.truth *= -1;
    for (int j = 0; j < Small::kJoints; ++j) {
      const Row row = bench.Next(j);
      const bool use = (moving >> j) & 1u;
      filter.Update(j, row.front, row.dense, row.y, use);
      if (use) recursion.Add(Augmented(row));
    }
    filter.EndSample(moving);
    recursion.Forget(bench.prior, moving);
    if (s % 100 == 99) {
      EXPECT_LT(Distance<Small>(Read(filter).x, recursion.Solve(bench.prior)), 0.01) << s;
    }
  }
}

// The same comparison must notice a filter that is fed wrongly.
TEST(ForgettingFilter, PlantedFault_MovesItAwayFromTheOracle) {
  enum Fault { kNone, kWrongSign, kLostRow, kUngatedRest };
  for (const Fault fault : {kNone, kWrongSign, kLostRow, kUngatedRest}) {
    Bench bench;
    bench.size = 3;
    for (float& lambda : bench.prior.lambda) lambda = 0.999f;
    SmallForgetting filter;
    filter.Restart(bench.prior);
    Recursion recursion;
    for (int s = 0; s < 400; ++s) {
      const bool rest = s >= 300;
      for (int j = 0; j < Small::kJoints; ++j) {
        Row row = bench.Next(j);
        if (!rest) recursion.Add(Augmented(row));
        if (fault == kWrongSign && j == 1) row.dense[4] = -row.dense[4];
        if (fault == kLostRow && s == 150 && j == 0) continue;
        if (rest) row.y += 3;  // torque at rest lies anywhere in the friction band
        filter.Update(j, row.front, row.dense, row.y, !rest || fault == kUngatedRest);
      }
      const std::uint32_t moving = rest && fault != kUngatedRest ? 0 : kAll;
      filter.EndSample(moving);
      recursion.Forget(bench.prior, rest ? 0 : kAll);
    }
    const double distance = Distance<Small>(Read(filter).x, recursion.Solve(bench.prior));
    if (fault == kNone) {
      EXPECT_LT(distance, 0.005);
    } else {
      EXPECT_GT(distance, 0.02) << fault;
    }
  }
}

TEST(ForgettingFilter, Report_IsTheInnovationOfTheDataAlone) {
  Bench bench;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  Matrix information = 1e-6 * Matrix::Identity(Small::kColumns, Small::kColumns);
  Vector right = Vector::Zero(Small::kColumns);
  int checked = 0;
  for (const Row& r : bench.Rows(60)) {
    const Vector h = Full<Small>(r);
    const Eigen::LDLT<Matrix> solver(information);
    const double innovation = r.y - h.dot(solver.solve(right)), variance = 1 + h.dot(solver.solve(h));
    const UpdateReport got = filter.Update(r.joint, r.front, r.dense, r.y, true);
    if (++checked > 60) {
      EXPECT_NEAR(got.innovation, innovation, 1e-3 * (1 + std::abs(innovation)));
      EXPECT_NEAR(got.variance / variance, 1, 1e-3);
    }
    information += h * h.transpose();
    right += h * r.y;
  }
}

TEST(ForgettingFilter, GatedOrRefusedRow_LeavesEveryBit) {
  Bench bench;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(50)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  const std::vector<float> before = Kept(filter);
  for (int j = 0; j < Small::kJoints; ++j) {
    Row row = bench.Next(j);
    EXPECT_EQ(filter.Update(j, row.front, row.dense, row.y, false).status, core::Status::kGated);
    row.dense[Small::kDense - 1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(filter.Update(j, row.front, row.dense, row.y, true).status, core::Status::kNotFinite);
    row.dense[Small::kDense - 1] = -2e6f;
    EXPECT_EQ(filter.Update(j, row.front, row.dense, row.y, true).status, core::Status::kOutOfRange);
  }
  EXPECT_EQ(Kept(filter), before);
}

TEST(ForgettingFilter, OneHourOfRest_LeavesEveryBit) {
  Bench bench;
  for (float& lambda : bench.prior.lambda) lambda = 0.99f;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(500)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  const std::vector<float> before = Kept(filter);
  const Row row = bench.Next(1);
  for (int s = 0; s < 125 * 3600; ++s) {
    filter.Update(1, row.front, row.dense, row.y, false);
    filter.EndSample(0);
  }
  EXPECT_EQ(Kept(filter), before);
}

TEST(ForgettingFilter, Solve_IsWhatTheDataAloneSay) {
  Bench bench;
  bench.size = 3;
  for (float& lambda : bench.prior.lambda) lambda = 0.998f;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  float x[Small::kColumns];
  filter.Solve(x);
  for (const float v : x) EXPECT_EQ(v, 0.0f);
  Recursion recursion;
  for (int s = 0; s < 500; ++s) {
    for (int j = 0; j < Small::kJoints; ++j) {
      const Row row = bench.Next(j);
      filter.Update(j, row.front, row.dense, row.y, true);
      recursion.Add(Augmented(row));
    }
    filter.EndSample(kAll);
    recursion.Forget(bench.prior, kAll);
  }
  filter.Solve(x);
  const Vector oracle =
      recursion.r.leftCols(Small::kColumns).triangularView<Eigen::Upper>().solve(recursion.r.col(Small::kColumns));
  for (int k = 0; k < Small::kColumns; ++k)
    EXPECT_NEAR(x[k], oracle(k), 1e-4) << k;  // sd about 0.01; float32 loses 1e-6 of 1
}

// The oracle of the next tests: Gentleman's rotations on a full triangle of floats, one row after the other, one
// column after the other. With the same operations the bits are the same.
template <class Layout>
struct RowByRow {
  static constexpr int n = Layout::kColumns;
  float d[n], r[n][n + 1] = {}, innovation = 0, variance = 0;

  RowByRow() {
    for (float& v : d) v = ForgettingFilter<Layout>::kFloor;
  }
  void Add(int joint, const float* front, const float* dense, float y) {
    float x[n + 1] = {}, weight = 1;
    const int first = Layout::kFrontBegin[joint], end = Layout::kFrontBegin[joint + 1];
    for (int k = first; k < end; ++k) x[k] = front[k - first];
    for (int k = Layout::kRowBegin[joint]; k < Layout::kDense; ++k) x[Layout::kFront + k] = dense[k];
    x[n] = y;
    for (int k = 0; k < n; ++k) {
      const bool own = k < Layout::kFront ? k >= first && k < end : k >= Layout::kFront + Layout::kRowBegin[joint];
      if (!own) continue;
      const float x0 = x[k], wx = weight * x0, next = d[k] + wx * x0, inverse = 1 / next;
      weight *= d[k] * inverse;
      d[k] = next;
      for (int c = k + 1; c <= n; ++c) {
        x[c] -= x0 * r[k][c];
        r[k][c] += wx * inverse * x[c];
      }
    }
    innovation = x[n];
    variance = 1 / weight;
  }
  void Forget(const Prior<Layout>& prior, std::uint32_t moving) {
    for (int k = 0; k < n; ++k) {
      const std::uint32_t needed = JointsOf<Layout>(k);
      if ((moving & needed) == needed) d[k] = std::max(d[k] * prior.lambda[k], ForgettingFilter<Layout>::kFloor);
    }
  }
};

// Kept bits of the filter against those of the oracle: [d, then R and z in the order in which the filter stores them].
template <class Layout>
void ExpectSameBits(const ForgettingFilter<Layout>& filter, const RowByRow<Layout>& oracle) {
  const float* stored = filter.triangle();
  for (int k = 0; k < Layout::kColumns; ++k) {
    ASSERT_EQ(filter.weights()[k], oracle.d[k]) << k;
    const int joint = JointOf<Layout>(k);
    for (int c = k + 1; c <= Layout::kColumns; ++c) {
      const bool dense = c >= Layout::kFront;
      const bool kept = k >= Layout::kFront ||
                        (dense ? c - Layout::kFront >= Layout::kRowBegin[joint] : c < Layout::kFrontBegin[joint + 1]);
      ASSERT_EQ(kept ? *stored++ : 0.0f, oracle.r[k][c]) << k << ", " << c;
    }
  }
  ASSERT_EQ(stored - filter.triangle(), ForgettingFilter<Layout>::kTriangle);
}

// Layouts that need every number of rows and columns at a time: odd and even dense columns, one to six front columns,
// more joints than are worked in together, a row without front columns, rows that begin at the same column or one
// apart, and one that begins before its predecessor.
struct OneColumn {
  static constexpr int kJoints = 1, kFront = 1, kDense = 1, kColumns = 2, kNonlinear = 0;
  static constexpr int kFrontBegin[2] = {0, 1}, kRowBegin[1] = {0};
};
struct EightJoints {
  static constexpr int kJoints = 8, kFront = 24, kDense = 27, kColumns = 51, kNonlinear = 0;
  static constexpr int kFrontBegin[9] = {0, 1, 3, 6, 10, 15, 21, 21, 24};
  static constexpr int kRowBegin[8] = {0, 1, 1, 6, 11, 14, 17, 24};
};
struct SevenJoints {
  static constexpr int kJoints = 7, kFront = 21, kDense = 44, kColumns = 65, kNonlinear = 0;
  static constexpr int kFrontBegin[8] = {0, 3, 6, 9, 12, 15, 18, 21}, kRowBegin[7] = {0, 1, 8, 15, 22, 29, 36};
};
struct Unordered {
  static constexpr int kJoints = 4, kFront = 9, kDense = 14, kColumns = 23, kNonlinear = 0;
  static constexpr int kFrontBegin[5] = {0, 2, 5, 7, 9}, kRowBegin[4] = {0, 5, 3, 9};
};

template <class Layout>
class RowsTogether : public testing::Test {};
using RowLayouts = testing::Types<Small, OneColumn, SevenJoints, EightJoints, Unordered>;
TYPED_TEST_SUITE(RowsTogether, RowLayouts);

TYPED_TEST(RowsTogether, InAnySlices_GiveTheBitsOfRowByRow_WhateverIsRefused) {
  using Layout = TypeParam;
  Prior<Layout> prior;
  for (float& lambda : prior.lambda) lambda = 0.99f;
  ForgettingFilter<Layout> filter;
  filter.Restart(prior);
  RowByRow<Layout> oracle;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  int slices = 0;
  for (int sample = 0; sample < 60; ++sample) {
    // Now and then a row is gated, has no number, or is not there at all.
    const auto some = [&](bool now) { return now ? static_cast<std::uint32_t>(random()) : 0u; };
    const std::uint32_t gated = some(sample % 5 == 1), broken = some(sample % 7 == 3), missing = some(sample % 11 == 7);
    float innovation[Layout::kJoints] = {}, variance[Layout::kJoints] = {};
    for (int i = 0; i < Layout::kJoints; ++i) {
      if (missing >> i & 1u) continue;
      float front[Layout::kFront], dense[Layout::kDense] = {}, y = normal(random);
      for (float& v : front) v = normal(random);
      for (int k = Layout::kRowBegin[i]; k < Layout::kDense; ++k) dense[k] = normal(random);
      if (broken >> i & 1u) dense[Layout::kDense - 1] = std::numeric_limits<float>::quiet_NaN();
      const bool use = !(gated >> i & 1u);
      filter.BeginRow(i, front, dense, y, use);
      int credit = kNoSlices;
      EXPECT_TRUE(filter.StepRow(credit));
      if (!use || (broken >> i & 1u)) continue;
      oracle.Add(i, front, dense, y);
      innovation[i] = oracle.innovation, variance[i] = oracle.variance;
    }
    for (int credit = 0; (credit += 1 + sample % 50, !filter.StepRows(credit));) ++slices;
    for (int i = 0; i < Layout::kJoints; ++i) {
      if (variance[i] == 0) continue;
      // A row that is worked in from a later row's first column on is rounded more often.
      const float rounding = std::is_same_v<Layout, Unordered> ? 1e-4f : 0.0f;
      EXPECT_NEAR(filter.report(i).innovation, innovation[i], rounding) << sample << ": " << i;
      EXPECT_NEAR(filter.report(i).variance / variance[i], 1, rounding) << sample << ": " << i;
    }
    const auto moving = static_cast<std::uint32_t>(sample % 3 == 0 ? random() : ~0u);
    filter.EndSample(moving);
    oracle.Forget(prior, moving);
    if (!std::is_same_v<Layout, Unordered>) {
      ASSERT_NO_FATAL_FAILURE(ExpectSameBits(filter, oracle)) << sample;
      continue;
    }
    const float* stored = filter.triangle();
    for (int k = Layout::kFront; k < Layout::kColumns; ++k)
      ASSERT_NEAR(filter.weights()[k] / oracle.d[k], 1, 1e-4) << sample << ": " << k;
    ASSERT_NEAR(stored[ForgettingFilter<Layout>::kTriangle - 1], oracle.r[Layout::kColumns - 1][Layout::kColumns],
                1e-3);
  }
  EXPECT_GT(slices, Layout::kColumns);
}

// In double: the block's rows of R are gone; where the dense columns may be anywhere in their prior, this is noise in
// the front columns' rows.
TEST(ForgettingFilter, Reset_ForgetsItsBlock_AndWhatWasKnownThroughIt) {
  for (int block = 0; block <= Small::kJoints; ++block) {
    Bench bench;
    bench.size = 0.1f;  // data that do not drown the prior
    SmallForgetting filter;
    filter.Restart(bench.prior);
    Recursion recursion;
    const auto learn = [&](int samples) {
      for (const Row& row : bench.Rows(samples)) {
        filter.Update(row.joint, row.front, row.dense, row.y, true);
        recursion.Add(Augmented(row));
      }
    };
    learn(300);
    filter.BeginReset(block);
    for (int credit = 8; !filter.StepReset(credit); credit = 8) {
    }
    const Posterior untouched = recursion.Solve(bench.prior);
    if (block < Small::kJoints) {
      recursion.r.middleRows(Small::kFrontBegin[block], Small::kFrontBegin[block + 1] - Small::kFrontBegin[block])
          .setZero();
    } else {
      recursion.r.bottomRows(Small::kDense).setZero();
      const Matrix prior = PriorCovariance(bench.prior).bottomRightCorner(Small::kDense, Small::kDense);
      for (int k = 0; k < Small::kFront; ++k) {
        const Vector coupling = recursion.r.row(k).segment(Small::kFront, Small::kDense);
        recursion.r.row(k) /= std::sqrt(1 + coupling.dot(prior * coupling));
      }
    }
    const Posterior oracle = recursion.Solve(bench.prior);
    const auto out = Read(filter);
    EXPECT_LT(Distance<Small>(out.x, oracle), 0.01) << block;
    for (int k = 0; k < Small::kColumns; ++k) EXPECT_NEAR(out.sd[k] / oracle.sd(k), 1, 1e-3) << block << ", " << k;
    if (block != 1) {                                              // this joint has no front columns
      EXPECT_GT(Distance<Small>(out.x, untouched), 0.1) << block;  // a reset that does nothing would show
    }
    learn(10);
    EXPECT_LT(Distance<Small>(Read(filter).x, recursion.Solve(bench.prior)), 0.01) << block;
  }
  EXPECT_FALSE(SmallForgetting::CanReset(-1));
  EXPECT_FALSE(SmallForgetting::CanReset(Small::kJoints + 1));
}

TEST(ForgettingFilter, WithoutData_ReadsThePrior) {
  Bench bench;
  SmallForgetting filter;
  filter.Restart(bench.prior);
  for (int s = 0; s < 100000; ++s) filter.EndSample(kAll);
  const SmallForgetting::ReadOut out = Read(filter);
  for (int k = 0; k < Small::kColumns; ++k) {
    EXPECT_EQ(out.x[k], 0.0f);
    EXPECT_NEAR(out.sd[k], 1.0f, 1e-5f);  // the floor counts as a millionth and was taken off
  }
}

}  // namespace
}  // namespace armcal::filter
