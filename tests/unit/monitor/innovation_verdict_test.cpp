// monitor - the consistency verdict on drawn innovations and against chi^2 itself.
#include "armcal/monitor/innovations.hpp"

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <limits>
#include <random>

namespace armcal::monitor {
namespace {

struct Rows {
  std::mt19937 random{5};
  std::normal_distribution<float> normal;
  InnovationTest verdict;

  void Add(int count, float size) {
    for (int k = 0; k < count; ++k) verdict.Add(1.7f * size * normal(random), 1.7f * 1.7f);
  }
};

double ShareBeyond(double freedom, double limit) {
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(freedom), limit));
}

TEST(InnovationTest, Limit_IsPassedOnceInAMillion) {
  const double rows = InnovationTest::kBlockRows;
  EXPECT_NEAR(ShareBeyond(rows, static_cast<double>(InnovationTest::kLimit) * rows), 1e-6, 2e-8);
}

TEST(ChiSquareLimit, OfAnyFreedom_IsPassedAsOftenAsStated) {
  for (const float freedom : {10.5f, 40.0f, 84.0f, 1000.0f}) {
    EXPECT_NEAR(ShareBeyond(freedom, ChiSquareLimit(freedom, 3.719f)), 1e-4, 2e-5) << freedom;
    EXPECT_NEAR(ShareBeyond(freedom, ChiSquareLimit(freedom, 1.645f)), 0.05, 0.002) << freedom;
  }
  EXPECT_LT(ShareBeyond(1, ChiSquareLimit(1, 3.719f)), 1e-4);  // of few degrees it is passed less often
}

TEST(InnovationTest, OfAConsistentFilter_StaysSilent) {
  Rows rows;
  for (int block = 0; block < 200; ++block) {
    rows.Add(InnovationTest::kBlockRows, 1.0f);
    EXPECT_FALSE(rows.verdict.inconsistent()) << block;
  }
}

TEST(InnovationTest, OfATorqueThatComesAndGoes_FollowsTheLastBlock) {
  Rows rows;
  rows.Add(InnovationTest::kBlockRows, 1.0f);
  rows.Add(InnovationTest::kBlockRows, 1.1f);  // a fifth more variance: nine standard deviations of the mean
  EXPECT_TRUE(rows.verdict.inconsistent());
  rows.Add(InnovationTest::kBlockRows, 1.0f);
  EXPECT_FALSE(rows.verdict.inconsistent());
}

TEST(InnovationTest, RowsThatAreNoNumbers_AreKeptOut) {
  Rows rows;
  for (int k = 0; k < 10000; ++k) rows.verdict.Add(std::numeric_limits<float>::quiet_NaN(), 1.0f);
  rows.Add(InnovationTest::kBlockRows, 1.0f);
  EXPECT_FALSE(rows.verdict.inconsistent());
}

}  // namespace
}  // namespace armcal::monitor
