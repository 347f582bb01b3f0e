// diagnosis tests - compares chances with tables of the chi-squared distribution.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/diagnose/diagnosis/search.hpp"

namespace armcal::diagnosis {
namespace {

TEST(LogUpperTail, IsThatOfTheTables) {
  const struct {
    int degrees;
    double x, tail;
  } table[] = {{1, 3.841459, 0.05},   {1, 10.827566, 0.001}, {2, 5.991465, 0.05},   {2, 13.815511, 0.001},
               {3, 7.814728, 0.05},   {3, 16.266236, 0.001}, {5, 20.515006, 0.001}, {10, 29.588298, 0.001},
               {15, 24.995790, 0.05}, {30, 59.703064, 0.001}};
  for (const auto& t : table)
    EXPECT_NEAR(std::exp(LogUpperTail(t.degrees, t.x)), t.tail, 1e-6 * t.tail + 1e-9) << t.degrees << " " << t.x;
}

// Far out the tail of one degree is sqrt(2 / (pi x)) exp(-x / 2) (1 - 1 / x ...), that of two exp(-x / 2).
TEST(LogUpperTail, HasDigitsFarOut) {
  for (const double x : {400.0, 599.0, 601.0, 5000.0, 1e6}) {
    EXPECT_NEAR(LogUpperTail(1, x), 0.5 * std::log(2 / (std::acos(-1.0) * x)) - x / 2, 2 / x);
    EXPECT_DOUBLE_EQ(LogUpperTail(2, x), -x / 2);
  }
  EXPECT_EQ(LogUpperTail(3, 0), 0);
}

}  // namespace
}  // namespace armcal::diagnosis
