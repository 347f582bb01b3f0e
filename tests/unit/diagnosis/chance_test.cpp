// diagnosis tests - compares chances with tables of the chi-squared distribution, and scores with sums by hand.
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

// A term of one amplitude on one joint of the small arm.
struct OneAmplitude {
  explicit OneAmplitude(double generic_penalty) {
    record.generic_penalty = generic_penalty;
    found.candidate = &candidate;
    found.gain.rank = 1;
  }
  codegen::EffectRecord record = codegen::ReadEffect("codegen/effects/load_friction.toml");
  Candidate candidate{record, codegen::ReadRobot("codegen/robots/two_link.toml"), {0}};
  Found found;
};

// The tail of two degrees is exp(-x / 2), that of four exp(-x / 2) (1 + x / 2).
TEST(LogChance, CountsWhatWasSearchedAsAnAmplitude_AndEveryTry) {
  OneAmplitude one(0);
  one.found.tried = 10, one.found.searched = 1;
  EXPECT_NEAR(LogChance(one.found, 30), std::log(10) - 15, 1e-9);
  one.found.searched = 3;
  EXPECT_NEAR(LogChance(one.found, 30), std::log(10) + std::log(16) - 15, 1e-9);
}

TEST(Score, PaysForParametersTriesAndForm) {
  OneAmplitude cause(0), curve(20);
  for (Found* f : {&cause.found, &curve.found}) f->penalty = 2, f->tried = 20;
  EXPECT_NEAR(Score(cause.found, 40), 38 - 5.991465, 1e-6);  // 2 ln 20
  EXPECT_NEAR(Score(curve.found, 40), 18 - 5.991465, 1e-6);
}

// k ln(gain / k), but not less than k and not more than k ln(rows).
TEST(Score, PriceOfAParameter_FollowsItsGain) {
  OneAmplitude one(0);
  one.found.searched = 2, one.found.penalty = 25;
  EXPECT_NEAR(PriceOf(one.found, 30), 3 * 2.302585, 1e-6);
  EXPECT_NEAR(PriceOf(one.found, 4), 3, 1e-12);
  EXPECT_NEAR(PriceOf(one.found, 1e6), 25, 1e-12);
  const double least = GainOfScore(one.found);
  EXPECT_LT(Score(one.found, 0.999 * least), 0);
  EXPECT_GT(Score(one.found, 1.001 * least), 0);
}

}  // namespace
}  // namespace armcal::diagnosis
