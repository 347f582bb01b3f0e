// verdict tests - the interval over splits holds the spread between runs, although the splits share runs.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host_sim/diagnose/verdict/spread.hpp"

namespace armcal::verdict {
namespace {

// Two groups: each refit is one group's own estimate, so the two are independent and the mean's variance is theirs
// halved.
TEST(Spread, OfTwoGroups_IsThatOfTwoIndependentEstimates) {
  const Spread s = SpreadOf({1.0, 1.2}, {0.0, 0.0});
  EXPECT_DOUBLE_EQ(s.mean, 1.1);
  EXPECT_NEAR(s.sd, 0.1, 1e-12);  // |1.2 - 1.0| / 2
  EXPECT_NEAR(s.upper - s.mean, 12.706 * 0.1, 1e-9);
}

TEST(Spread, OfEqualEstimates_IsWhatTheFitsSay) {
  // Each refit of three groups has two groups' rows and a deviation of 0.1; all three groups: 0.1 sqrt(2 / 3).
  const Spread s = SpreadOf({0.5, 0.5, 0.5}, {0.1, 0.1, 0.1});
  EXPECT_EQ(s.between, 0);
  EXPECT_NEAR(s.sd, 0.1 * std::sqrt(2.0 / 3.0), 1e-12);
}

// Runs whose true value differs from run to run by far more than the noise within one. The interval that takes the
// refits as independent is too short; this one holds the mean in 95 % of the draws.
TEST(Spread, WhereRunsDiffer_ItsIntervalHoldsTheMean) {
  constexpr int kDraws = 4000, kRuns = 4;
  constexpr double kMean = 3, kBetween = 0.5, kWithin = 0.05;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  int holds = 0, naive = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    double run[kRuns], sum = 0;
    for (double& r : run) sum += r = kMean + kBetween * normal(random) + kWithin * normal(random);
    std::vector<double> refit, sd(kRuns, kWithin / std::sqrt(kRuns - 1));
    for (const double r : run) refit.push_back((sum - r) / (kRuns - 1));
    const Spread s = SpreadOf(refit, sd);
    holds += s.lower < kMean && kMean < s.upper;
    double square = 0;
    for (const double r : refit) square += (r - s.mean) * (r - s.mean);
    naive += std::abs(s.mean - kMean) < 3.182 * std::sqrt(square / (kRuns - 1) / kRuns);
  }
  // 95 % of 4000 draws, five standard deviations of a binomial to either side.
  EXPECT_NEAR(holds / static_cast<double>(kDraws), 0.95, 0.0175);
  EXPECT_LT(naive / static_cast<double>(kDraws), 0.7);
}

}  // namespace
}  // namespace armcal::verdict
