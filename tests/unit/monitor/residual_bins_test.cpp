// monitor - residual statistics of random rows against sums in double.
#include "armcal/monitor/residual_statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>
#include <vector>

namespace armcal::monitor {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

const float* BinOf(const float* set, int signal, int direction, int quarter) {
  return set + ((signal * ResidualBins::kDirections + direction) * ResidualBins::kQuarters + quarter) * kResidualSums;
}

double Total(const float* set, int signal, int sum) {
  double total = 0;
  for (int d = 0; d < 2; ++d)
    for (int q = 0; q < 4; ++q) total += static_cast<double>(BinOf(set, signal, d, q)[sum]);
  return total;
}

// Every signal keeps to the middles of the quarters of its range, so that no rounding decides about the bin.
struct RandomRows {
  std::mt19937 random{7};
  std::normal_distribution<float> normal;

  float Middle(float low, float high, int quarter) const {
    return low + (high - low) * (static_cast<float>(quarter) + 0.5f) / 4;
  }
  int Quarter() { return static_cast<int>(random() % 4); }

  // The ends of every range, so that all of it has been seen.
  ResidualRow End(bool high) const {
    return high ? ResidualRow{1, 2.0f, 1.5f, 90, 45} : ResidualRow{-1, -0.0625f, -0.5f, -30, 25};
  }
  // quarters: which of each signal
  ResidualRow Next(int (&quarter)[kResidualSignals]) {
    for (int& q : quarter) q = Quarter();
    const float size = Middle(0.0625f, 2.0f, quarter[kBySpeed]);
    return {5 + 3 * normal(random), random() % 2 ? size : -size, Middle(-0.5f, 1.5f, quarter[kByPosition]),
            Middle(-30, 90, quarter[kByLoad]), Middle(25, 45, quarter[kByTemperature])};
  }
};

TEST(ResidualBins, EveryBin_HoldsTheSumsOfItsRows) {
  RandomRows rows;
  ResidualBins bins;
  std::map<std::tuple<int, int, int>, std::array<double, kResidualSums>> expected;
  const auto add = [&](const ResidualRow& r, const int(&quarter)[kResidualSignals]) {
    EXPECT_TRUE(bins.Add(r, true));
    const double v[kResidualSums] = {1,
                                     r.residual_Nm,
                                     double{r.residual_Nm} * r.residual_Nm,
                                     r.speed_radps,
                                     r.position_rad,
                                     r.load_Nm,
                                     std::abs(r.load_Nm),
                                     r.temperature_degC};
    for (int s = 0; s < kResidualSignals; ++s)
      for (int k = 0; k < kResidualSums; ++k) expected[{s, r.speed_radps > 0, quarter[s]}][k] += v[k];
  };
  add(rows.End(false), {0, 0, 0, 0});
  add(rows.End(true), {3, 3, 3, 3});
  for (int i = 2; i < 16000; ++i) {
    int quarter[kResidualSignals];
    const ResidualRow r = rows.Next(quarter);
    add(r, quarter);
  }
  ASSERT_EQ(expected.size(), 32u);
  for (const auto& [key, sums] : expected) {
    const auto& [signal, direction, quarter] = key;
    const float* bin = BinOf(bins.reference(), signal, direction, quarter);
    // 2000 additions to a sum round by half a last place each at most: 2000 x 6e-8, of what was added in size.
    for (int k = 0; k < kResidualSums; ++k)
      EXPECT_NEAR(bin[k], sums[k], 1.2e-4 * std::max(sums[kCount] * 10, std::abs(sums[k]))) << signal << direction << k;
    EXPECT_EQ(bin[kCount], sums[kCount]);
  }
  EXPECT_EQ(Total(bins.recent(), kBySpeed, kCount), 0);
}

TEST(ResidualBins, TheReference_IsTheFirstRowsAndStays) {
  ResidualBins bins;
  RandomRows rows;
  int quarter[kResidualSignals];
  double first = 0;
  for (std::uint32_t i = 0; i < 3 * ResidualBins::kReferenceRows; ++i) {
    ResidualRow r = rows.Next(quarter);
    r.residual_Nm = i < ResidualBins::kReferenceRows ? 2.0f : -7.0f;
    first += i < ResidualBins::kReferenceRows ? 2.0 : 0.0;
    bins.Add(r, true);
  }
  EXPECT_EQ(Total(bins.reference(), kByLoad, kResidual), first);
  EXPECT_NEAR(Total(bins.recent(), kByLoad, kResidual) / Total(bins.recent(), kByLoad, kCount), -7, 1e-4);
}

// What fades as fast as it comes in cannot grow to 2^24, where a float32 count would stop.
TEST(ResidualBins, LongRuns_NeitherSaturateNorForgetHowToForget) {
  ResidualBins bins;
  RandomRows rows;
  int quarter[kResidualSignals];
  std::vector<ResidualRow> some;
  for (int i = 0; i < 4096; ++i) some.push_back(rows.Next(quarter));
  const auto run = [&](int count, float residual_Nm) {
    for (int i = 0; i < count; ++i) {
      some[i % 4096].residual_Nm = residual_Nm;
      bins.Add(some[i % 4096], true);
    }
  };
  for (int round = 0; round < 4; ++round) {
    run(500'000, 1.0f);
    for (int signal = 0; signal < kResidualSignals; ++signal) {
      // A bin is faded by 32/16384 every 32 rows: it balances at 16384 rows, but for the saw-tooth of a round.
      EXPECT_NEAR(Total(bins.recent(), signal, kCount), 16384, 40) << signal;
      EXPECT_NEAR(Total(bins.recent(), signal, kSquare), 16384, 40) << signal;
    }
  }
  run(16384, 3.0f);  // one memory later, 1 - 1/e of the weight is new
  EXPECT_NEAR(Total(bins.recent(), kBySpeed, kResidual) / Total(bins.recent(), kBySpeed, kCount),
              3 - 2 * std::exp(-1.0), 0.01);
}

TEST(ResidualBins, ABinThatIsNotVisited_FadesLikeTheOthers) {
  ResidualBins bins;
  for (std::uint32_t i = 0; i < ResidualBins::kReferenceRows + 4000; ++i)
    bins.Add({1, i % 2 ? 1.0f : -1.0f, static_cast<float>(i % 2), 0, kNan}, true);
  const float before = BinOf(bins.recent(), kByPosition, 0, 0)[kCount];
  for (int i = 0; i < 16384; ++i) bins.Add({1, 1.0f, 1.0f, 0, kNan}, true);
  EXPECT_NEAR(BinOf(bins.recent(), kByPosition, 0, 0)[kCount] / before, std::exp(-1.0), 0.01);
}

TEST(ResidualBins, NotFiniteHugeOrUnusedRows_LeaveEverySum) {
  const float infinite = std::numeric_limits<float>::infinity();
  ResidualBins bins;
  RandomRows rows;
  int quarter[kResidualSignals];
  for (std::uint32_t i = 0; i < ResidualBins::kReferenceRows + 999; ++i) bins.Add(rows.Next(quarter), true);
  const ResidualBins before = bins;
  const ResidualRow bad[] = {{kNan, 1, 1, 1, 30},      {infinite, 1, 1, 1, 30}, {1, kNan, 1, 1, 30},
                             {1, 1, -infinite, 1, 30}, {1, 1, 1, kNan, 30},     {1e30f, 1, 1, 1, 30},
                             {1, 1, 1, 3e38f, 30}};
  for (const ResidualRow& r : bad) EXPECT_FALSE(bins.Add(r, true));
  EXPECT_FALSE(bins.Add({1, 1, 1, 1, 30}, false));
  EXPECT_TRUE(std::equal(before.reference(), before.reference() + ResidualBins::kValues, bins.reference()));
  EXPECT_TRUE(std::equal(before.recent(), before.recent() + ResidualBins::kValues, bins.recent()));
}

TEST(ResidualBins, WithoutATemperature_OnlyItsBinsStayEmpty) {
  ResidualBins bins;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(bins.Add({1, 0.1f * static_cast<float>(i + 1), 1, 1, kNan}, true));
  EXPECT_EQ(Total(bins.reference(), kByTemperature, kCount), 0);
  for (const int s : {kBySpeed, kByPosition, kByLoad}) {
    EXPECT_EQ(Total(bins.reference(), s, kCount), 100);
    EXPECT_EQ(Total(bins.reference(), s, kTemperature), 0);
  }
}

}  // namespace
}  // namespace armcal::monitor
