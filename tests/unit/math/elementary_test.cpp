// math - the elementary functions against long double.
#include "armcal/math/elementary.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace armcal::math {
namespace {

// Largest |f(x) - exact(x)| / weight over a grid and random points of [from, to].
template <class F, class E, class W>
long double WorstError(float from, float to, F f, E exact, W weight) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(from, to);
  long double worst = 0;
  for (int i = 0; i <= 400000; ++i) {
    const float x = i <= 200000 ? from + (to - from) * static_cast<float>(i) / 200000.0f : any(random);
    const long double e = exact(static_cast<long double>(x));
    worst = std::max(worst, std::abs(static_cast<long double>(f(x)) - e) / weight(x, e));
  }
  return worst;
}
const auto kAbsolute = [](float, long double) { return 1.0L; };
const auto kRelative = [](float, long double e) { return std::max(std::abs(e), 1e-38L); };
float SinOf(float x) {
  float s, c;
  SinCos(x, s, c);
  return s;
}
float CosOf(float x) {
  float s, c;
  SinCos(x, s, c);
  return c;
}
const auto kSin = [](long double x) { return std::sin(x); };
const auto kCos = [](long double x) { return std::cos(x); };

TEST(Elementary, SinCos_UpTo1000Rad_KeepsItsStatedError) {
  EXPECT_LT(WorstError(-1000, 1000, SinOf, kSin, kAbsolute), 1.2e-7L);
  EXPECT_LT(WorstError(-1000, 1000, CosOf, kCos, kAbsolute), 1.2e-7L);
  EXPECT_LT(WorstError(-7, 7, SinOf, kSin, kAbsolute), 1.2e-7L);
  EXPECT_LT(WorstError(-1e-3f, 1e-3f, SinOf, kSin, [](float x, long double) { return std::abs(x) + 1e-30L; }), 2e-7L);
}

TEST(Elementary, SinCosBlock_GivesTheBitsOfSinCos) {
  const float x[4] = {-2.5f, 0.0f, 1.0f, 400.0f};
  float s[4], c[4];
  SinCosBlock<4>(x, s, c);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(s[i], SinOf(x[i]));
    EXPECT_EQ(c[i], CosOf(x[i]));
  }
}

TEST(Elementary, ExpLogTanhCbrt_OverTheirRange_KeepTheirStatedError) {
  EXPECT_LT(WorstError(
                -87, 88, [](float x) { return Exp(x); }, [](long double x) { return std::exp(x); }, kRelative),
            2e-7L);
  const auto log = [](long double x) { return std::log(x); };
  const auto log_weight = [](float, long double e) { return 6e-8L + 1.2e-7L * std::abs(e); };
  EXPECT_LT(WorstError(
                1e-6f, 4.0f, [](float x) { return Log(x); }, log, log_weight),
            1);
  EXPECT_LT(WorstError(
                1.2e-38f, 1e38f, [](float x) { return Log(x); }, log, log_weight),
            1);
  const auto tanh = [](long double x) { return std::tanh(x); };
  EXPECT_LT(WorstError(
                -12, 12, [](float x) { return Tanh(x); }, tanh, kRelative),
            3e-7L);
  EXPECT_LT(WorstError(
                -1e-3f, 1e-3f, [](float x) { return Tanh(x); }, tanh, kRelative),
            3e-7L);
  const auto cbrt = [](long double x) { return std::cbrt(x); };
  EXPECT_LT(WorstError(
                -100, 100, [](float x) { return Cbrt(x); }, cbrt, kRelative),
            3e-7L);
  EXPECT_LT(WorstError(
                1e-37f, 1e-30f, [](float x) { return Cbrt(x); }, cbrt, kRelative),
            3e-7L);
  EXPECT_LT(WorstError(
                1e30f, 1e38f, [](float x) { return Cbrt(x); }, cbrt, kRelative),
            3e-7L);
}

TEST(Elementary, Pow_OfNonNegative_KeepsItsStatedError) {
  for (const float y : {0.33f, 0.5f, 1.7f, 2.0f, 3.0f})
    EXPECT_LT(WorstError(
                  1e-4f, 50.0f, [y](float x) { return Pow(x, y); },
                  [y](long double x) { return std::pow(x, static_cast<long double>(y)); },
                  [](float, long double e) { return (2 + std::abs(std::log(e))) * 2e-7L * e; }),
              1);
  EXPECT_EQ(Pow(0.0f, 0.5f), 0.0f);
  EXPECT_EQ(Pow(0.0, 0.5), 0.0);
}

TEST(Elementary, NotANumber_ComesOutAsNotANumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(SinOf(nan)) && std::isnan(CosOf(nan)) && std::isnan(Exp(nan)) && std::isnan(Log(nan)));
  EXPECT_TRUE(std::isnan(Tanh(nan)) && std::isnan(Cbrt(nan)) && std::isnan(Pow(nan, 2.0f)));
  EXPECT_TRUE(std::isnan(SinOf(std::numeric_limits<float>::infinity())));
  EXPECT_EQ(Masked(nan, 0u), 0.0f);
  EXPECT_FALSE(IsFinite(nan) || IsFinite(-std::numeric_limits<float>::infinity()));
  EXPECT_TRUE(IsFinite(3e38f));
}

TEST(Elementary, Ends_AreGuarded) {
  EXPECT_EQ(Exp(-100.0f), 0.0f);
  EXPECT_EQ(Exp(1000.0f), Exp(88.0f));
  EXPECT_EQ(Log(0.0f), Log(-3.0f));
  EXPECT_EQ(Cbrt(0.0f), 0.0f);
  EXPECT_EQ(Divide(3.0f, 0.0f), 0.0f);
  EXPECT_EQ(Divide(3.0f, -2.0f), -1.5f);
  EXPECT_EQ(Sign(-0.3f), -1.0f);
  EXPECT_EQ(Sign(0.0f), 0.0f);
}

TEST(Elementary, LogOfADouble_OverItsRange_KeepsItsStatedError) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> exponent(-1021, 1023), mantissa(1, 2), near(0.5, 2);
  long double worst = 0;
  for (int i = 0; i < 400000; ++i)
    for (const double x : {std::ldexp(mantissa(random), static_cast<int>(exponent(random))), near(random),
                           1 + std::ldexp(mantissa(random), -i % 50)}) {
      const long double exact = std::log(static_cast<long double>(x));
      worst = std::max(worst, std::abs(static_cast<long double>(Log(x)) - exact) / std::abs(exact));
    }
  EXPECT_LT(worst, 5e-16L);
  EXPECT_EQ(Log(1.0), 0.0);
  EXPECT_EQ(Log(-3.0), Log(0.0));
  EXPECT_LT(Log(0.0), -708.0);
  EXPECT_TRUE(std::isnan(Log(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(Log(std::numeric_limits<double>::infinity()), std::numeric_limits<double>::infinity());
}

TEST(Elementary, OtherScalars_UseTheStandardFunctions) {
  double s, c;
  SinCos(1.25, s, c);
  EXPECT_EQ(s, std::sin(1.25));
  EXPECT_EQ(c, std::cos(1.25));
  EXPECT_EQ(Exp(0.5L), std::exp(0.5L));
  EXPECT_EQ(Tanh(-0.5), std::tanh(-0.5));
}

}  // namespace
}  // namespace armcal::math
