// report tests - thinning keeps every peak and every gap of series that were made by hand or at random.
#include "host_sim/data/report/thin.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace armcal::report {
namespace {

using Column = std::vector<double>;

Column Random(std::size_t rows, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Column y(rows);
  for (double& v : y) v = normal(random);
  return y;
}

// By sorting, not by comparing one after the other.
double Lowest(Column y) {
  std::erase_if(y, [](double v) { return !std::isfinite(v); });
  std::sort(y.begin(), y.end());
  return y.front();
}

Column Taken(const Column& y, const std::vector<std::size_t>& rows) {
  Column out;
  for (const std::size_t k : rows) out.push_back(y.at(k));
  return out;
}

Column Negative(Column y) {
  for (double& v : y) v = -v;
  return y;
}

TEST(KeepExtremes, EveryStretchKeepsItsLowestAndHighestOfEveryColumn) {
  constexpr std::size_t kRows = 10000, kStretches = 100, kLength = kRows / kStretches;
  const Column a = Random(kRows, 1), b = Random(kRows, 2);
  const auto rows = KeepExtremes({&a, &b}, kStretches);
  EXPECT_LE(rows.size(), 4 * kStretches + 2);
  for (const Column* y : {&a, &b}) {
    for (std::size_t s = 0; s < kStretches; ++s) {
      const auto first = static_cast<std::ptrdiff_t>(s * kLength), last = first + static_cast<std::ptrdiff_t>(kLength);
      const Column all(y->begin() + first, y->begin() + last);
      std::vector<std::size_t> inside;
      for (const std::size_t k : rows)
        if (k >= s * kLength && k < (s + 1) * kLength) inside.push_back(k);
      const Column kept = Taken(*y, inside);
      EXPECT_EQ(Lowest(kept), Lowest(all)) << s;
      EXPECT_EQ(Lowest(Negative(kept)), Lowest(Negative(all))) << s;
    }
  }
}

TEST(KeepExtremes, RowsRise_AndTheEndsStay) {
  const Column y = Random(5000, 3);
  const auto rows = KeepExtremes({&y}, 50);
  EXPECT_EQ(rows.front(), 0u);
  EXPECT_EQ(rows.back(), 4999u);
  EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end(), std::greater_equal<>()), rows.end());
}

TEST(KeepExtremes, AGapOfOneRowStays_AndHidesNoPeak) {
  Column y(1000, 0.0);
  y[500] = NAN, y[501] = 7, y[503] = -7;
  const auto rows = KeepExtremes({&y}, 10);
  for (const std::size_t k : {500u, 501u, 503u}) EXPECT_TRUE(std::binary_search(rows.begin(), rows.end(), k)) << k;
}

TEST(KeepExtremes, ColumnsOfGapsOnly_GiveOneRowAStretch) {
  const Column y(1000, NAN);
  EXPECT_EQ(KeepExtremes({&y}, 10).size(), 11u);  // and the last row
}

TEST(KeepExtremes, ShortColumnsStayWhole) {
  const Column y = Random(20, 4), z = Random(20, 5);
  EXPECT_EQ(KeepExtremes({&y}, 10).size(), 20u);
  EXPECT_EQ(KeepExtremes({&y, &z}, 5).size(), 20u);
  EXPECT_TRUE(KeepExtremes({}, 5).empty());
}

}  // namespace
}  // namespace armcal::report
