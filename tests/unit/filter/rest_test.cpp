// filter - motion that teaches nothing, and columns that must not move at rest.
#include <gtest/gtest.h>

#include <limits>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

// Every second sample rests: if a turn passed at rest, two of the four columns would get all the noise.
TEST(Rest, BetweenMotions_TakesNoColumnsTurnOfProcessNoise) {
  Bench bench;
  for (const int k : {0, 1, 2, 3}) bench.prior.noise[k] = 1e-3f;
  KalmanFilter<Small> filter;
  filter.Restart(bench.prior);
  for (int s = 0; s < 800; ++s) filter.EndSample(s % 2 == 0 ? kAll : 0u);
  const auto out = Read(filter);
  // 400 samples of motion; of the four columns, the last one had its turn in the last of them.
  for (const int k : {0, 1, 2, 3}) EXPECT_NEAR(out.sd[k] * out.sd[k], 1 + (397 + k) * 1e-3, 1e-4) << k;
}

// 0.98^100000 is far below the smallest float.
TEST(Rest, MotionWithoutAUsableRow_ForgetsDownToThePriorAndNoFurther) {
  Bench bench;
  for (float& lambda : bench.prior.lambda) lambda = 0.98f;
  ForgettingFilter<Small> filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(200)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  Row broken = bench.Next(1);
  broken.y = std::numeric_limits<float>::quiet_NaN();
  for (int s = 0; s < 100000; ++s) {
    filter.Update(1, broken.front, broken.dense, broken.y, true);
    filter.EndSample(kAll);
  }
  const auto out = Read(filter);
  for (int k = 0; k < Small::kColumns; ++k) {
    EXPECT_NEAR(out.x[k], 0, 1e-3) << k;  // a millionth of the prior's weight is left of what was known
    EXPECT_NEAR(out.sd[k], 1, 1e-3) << k;
  }
  // And it learns again.
  const std::vector<Row> rows = bench.Rows(200);
  for (const Row& r : rows) filter.Update(r.joint, r.front, r.dense, r.y, true);
  EXPECT_LT(Distance<Small>(Read(filter).x, SolveBatch(bench.prior, rows)), 0.01);
}

}  // namespace
}  // namespace armcal::filter
