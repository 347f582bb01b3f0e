// health - tests the onset on histories that are written down by hand.
#include "host_sim/diagnose/health/joint_health.hpp"

#include <gtest/gtest.h>

namespace armcal::health {
namespace {

// Slices that end at the given times, with these mean squares, one row a second.
std::vector<client::ResidualSlice> Slices(const std::vector<std::pair<double, double>>& end_and_mean_square) {
  std::vector<client::ResidualSlice> slices;
  double start_s = 0;
  for (const auto& [end_s, mean_square] : end_and_mean_square) {
    slices.push_back({start_s, end_s - start_s, mean_square * (end_s - start_s)});
    start_s = end_s;
  }
  return slices;
}

TEST(Onset, BetweenTwoSlices_IsTheirBorder) {
  const auto onset = FindOnset(Slices({{1000, 4}, {1500, 4.1}, {1800, 3.9}, {1900, 9}, {2000, 9.2}}), 2000);
  ASSERT_TRUE(onset);
  EXPECT_NEAR(onset->at_s, 1800, 25);
}

TEST(Onset, InsideASlice_IsWhereItsMeanSquareSays) {
  // the change began at 1600 of the slice from 1500 to 1800: a third of it old, two thirds new
  const auto onset =
      FindOnset(Slices({{1000, 4}, {1500, 4}, {1800, 4 / 3.0 + 9 * 2 / 3.0}, {1900, 9}, {2000, 9}}), 2000);
  ASSERT_TRUE(onset);
  EXPECT_NEAR(onset->at_s, 1600, 1);
  EXPECT_LE(onset->earliest_s, 1600);
  EXPECT_GE(onset->latest_s, 1600);
}

TEST(Onset, TimeAtRest_DoesNotMoveIt) {
  auto slices = Slices({{1000, 4}, {1500, 4}, {9000, 4}, {9500, 9}, {10000, 9}});
  slices[2].count = slices[2].square = 0;  // this joint stood still
  const auto onset = FindOnset(slices, 10000);
  ASSERT_TRUE(onset);
  EXPECT_NEAR(onset->at_s, 9000, 1);
}

TEST(Onset, WithoutAGrowth_IsNone) {
  EXPECT_FALSE(FindOnset(Slices({{1000, 9}, {1500, 4}, {2000, 4}}), 2000));
  EXPECT_FALSE(FindOnset(Slices({{1000, 9}}), 1000));
  EXPECT_FALSE(FindOnset({}, 1000));
}

}  // namespace
}  // namespace armcal::health
