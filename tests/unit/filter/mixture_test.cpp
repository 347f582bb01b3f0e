// filter - the bank's prediction and mixture against dense algebra in double.
#include <gtest/gtest.h>

#include "armcal/filter/model_bank.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

using SmallBank = ModelBank<Small>;
constexpr int kDrifting = 4, kSlope = Small::kColumns + 2;  // of joint 2

struct Mixture : testing::Test {
  Bench bench;
  SmallBank filter;
  Mixture() {
    bench.size = 3;
    for (const int k : {1, kDrifting}) bench.prior.noise[k] = 1e-5f;
    filter.Restart(bench.prior);
  }
  void Rows() {
    for (int j = 0; j < Small::kJoints; ++j) {
      const Row row = bench.Next(j);
      filter.Update(j, row.front, row.dense, row.y, true);
    }
  }
  // By columns, slopes after all others.
  Matrix Covariance(int member) const {
    constexpr int n = SmallBank::Estimate::kSize;
    Matrix p = Matrix::Zero(n, n);
    for (int k = 0; k < n; ++k) {
      float u[n];
      const double d = filter.estimate(member).Spread(k, u);
      const Vector column = Eigen::Map<const Eigen::VectorXf>(u, n).cast<double>();
      p += d * column * column.transpose();
    }
    return p;
  }
  double At(int member, int column) const {
    return filter.estimate(member).x(SmallBank::Columns::kAt.position[column]);
  }
};

// x' = F x and P' = F P F' + Q; Q is diagonal, so beside the diagonal only F counts.
TEST_F(Mixture, EachMembersColumn_TakesItsSlope_AndTheirCovariancesWithAllOthers) {
  double largest = 0;  // share of the slope's covariance
  for (int s = 1; s < 300; ++s) {
    Rows();
    Matrix before[SmallBank::kMembers];
    double x[SmallBank::kMembers];
    for (int m = 0; m < SmallBank::kMembers; ++m) {
      before[m] = Covariance(m);
      x[m] = At(m, kDrifting) + At(m, kSlope);
    }
    filter.EndSample(kAll);
    for (int m = 0; m < SmallBank::kMembers; ++m) {
      const Matrix after = Covariance(m);
      const auto scale = [&](int i, int j) { return 1e-5 * std::sqrt(after(i, i) * after(j, j)); };
      if (s % 10 != 0) {  // at every tenth sample the members exchange their means
        EXPECT_NEAR(At(m, kDrifting), x[m], 1e-6);
      }
      for (int k = Small::kFront; k < Small::kColumns; ++k) {
        EXPECT_NEAR(after(kDrifting, k), before[m](kDrifting, k) + before[m](kSlope, k), scale(kDrifting, k)) << k;
        largest = std::max(largest, std::abs(before[m](kSlope, k)) / scale(kDrifting, k));
      }
      EXPECT_NEAR(after(kDrifting, kSlope), before[m](kDrifting, kSlope) + before[m](kSlope, kSlope),
                  scale(kDrifting, kSlope));
    }
  }
  EXPECT_GT(largest, 5);  // or the tolerance would hide it
}

TEST_F(Mixture, ReadOut_HasTheMeanAndVarianceOfTheMembersTogether) {
  double apart = 0;
  for (int s = 0; s < 1020; ++s) {
    if (s == 1000) bench.truth(kDrifting) += 0.1;  // some follow at once, some do not
    Rows();
    filter.EndSample(kAll);
    if (s < 1000) continue;
    const SmallBank::ReadOut out = Read(filter);
    double mean = 0, square = 0, within = 0;
    for (int m = 0; m < SmallBank::kMembers; ++m) {
      const double weight = filter.weight(2, m), x = At(m, kDrifting), variance = Covariance(m)(kDrifting, kDrifting);
      mean += weight * x;
      within += weight * variance;
      square += weight * (variance + x * x);
    }
    EXPECT_NEAR(out.x[kDrifting], mean, 1e-6);
    EXPECT_NEAR(out.sd[kDrifting] * out.sd[kDrifting] / (square - mean * mean), 1, 2e-3);
    apart = std::max(apart, (square - mean * mean) / within);
  }
  EXPECT_GT(apart, 1.1);  // or the test would show nothing
}

}  // namespace
}  // namespace armcal::filter
