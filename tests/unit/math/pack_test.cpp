// math tests - packs of samples: every lane gives what its scalar gives, and a generated model takes them.
#include "armcal/math/pack.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "codegen/generated/er20_like/model.hpp"

namespace armcal::math {
namespace {

using Doubles = Pack<double, 8>;
using Floats = Pack<float, 16>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

// The same number or both not a number; -0 and 0 differ.
template <class T>
bool Same(T a, T b) {
  return std::isnan(a) ? std::isnan(b) : a == b && std::signbit(a) == std::signbit(b);
}

// f of a pack against f of each lane's number, over numbers of every kind.
template <class P, class F>
void ExpectLanesOfScalars(const char* name, F f) {
  using T = decltype(P()[0]);
  std::vector<T> numbers;
  for (const double x : {0.0, -0.0, 1.0, -1.0, 0.5, 3.0, -7.25, 1e-31, -1e-31, 1e-3, 40.0, kNan, kInfinity, -kInfinity})
    numbers.push_back(static_cast<T>(x));
  for (std::size_t first = 0; first < numbers.size(); ++first) {
    P a, b;
    for (int lane = 0; lane < P::kLanes; ++lane) {
      a.Set(lane, numbers[first]);
      b.Set(lane, numbers[(first + static_cast<std::size_t>(lane)) % numbers.size()]);
    }
    const P result = f(a, b);
    for (int lane = 0; lane < P::kLanes; ++lane) {
      const T x = a[lane], y = b[lane];
      EXPECT_TRUE(Same(result[lane], f(x, y))) << name << "(" << x << ", " << y << "): " << result[lane];
    }
  }
}

template <class P>
void ExpectElementaryFunctions() {
  ExpectLanesOfScalars<P>("a + b", [](const auto& a, const auto& b) { return a + b; });
  ExpectLanesOfScalars<P>("a - b", [](const auto& a, const auto& b) { return a - b; });
  ExpectLanesOfScalars<P>("a * -b", [](const auto& a, const auto& b) { return a * -b; });
  ExpectLanesOfScalars<P>("a / b", [](const auto& a, const auto& b) { return a / b; });
  ExpectLanesOfScalars<P>("Sign", [](const auto&, const auto& b) { return Sign(b); });
  ExpectLanesOfScalars<P>("Abs", [](const auto&, const auto& b) { return Abs(b); });
  ExpectLanesOfScalars<P>("Min", [](const auto& a, const auto& b) { return Min(a, b); });
  ExpectLanesOfScalars<P>("Max", [](const auto& a, const auto& b) { return Max(a, b); });
  ExpectLanesOfScalars<P>("Divide", [](const auto& a, const auto& b) { return Divide(a, b); });
  ExpectLanesOfScalars<P>("Sqrt", [](const auto&, const auto& b) { return Sqrt(b); });
  ExpectLanesOfScalars<P>("Exp", [](const auto&, const auto& b) { return Exp(b); });
  ExpectLanesOfScalars<P>("Log", [](const auto&, const auto& b) { return Log(Abs(b)); });
  ExpectLanesOfScalars<P>("Tanh", [](const auto&, const auto& b) { return Tanh(b); });
  ExpectLanesOfScalars<P>("Cbrt", [](const auto&, const auto& b) { return Cbrt(b); });
  ExpectLanesOfScalars<P>("Pow", [](const auto& a, const auto& b) { return Pow(a, b); });
}

TEST(Pack, ElementaryFunctions_GiveEachLaneWhatItsScalarGives) {
  ExpectElementaryFunctions<Doubles>();
  ExpectElementaryFunctions<Floats>();
  ExpectElementaryFunctions<Pack<double, 2>>();
}

TEST(Pack, SineAndCosineOfFloats_HaveTheScalarsBits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1000, 1000);
  for (int k = 0; k < 20000; ++k) {
    Floats x, s, c;
    for (int lane = 0; lane < 16; ++lane) x.Set(lane, any(random));
    SinCos(x, s, c);
    for (int lane = 0; lane < 16; ++lane) {
      float sine, cosine;
      SinCos(x[lane], sine, cosine);
      ASSERT_EQ(BitsOf(s[lane]), BitsOf(sine)) << x[lane];
      ASSERT_EQ(BitsOf(c[lane]), BitsOf(cosine)) << x[lane];
    }
  }
}

TEST(Pack, SineAndCosineOfDoubles_KeepTheirStatedError) {
  std::mt19937_64 random(2);
  for (const double range : {1e-3, 0.8, 7.0, 1000.0, 1e5}) {
    std::uniform_real_distribution<double> any(-range, range);
    long double worst = 0;
    for (int k = 0; k < 40000; ++k) {
      Doubles x, s, c;
      for (int lane = 0; lane < 8; ++lane) x.Set(lane, any(random));
      SinCos(x, s, c);
      for (int lane = 0; lane < 8; ++lane) {
        worst = std::max(worst, std::abs(s[lane] - std::sin(static_cast<long double>(x[lane]))));
        worst = std::max(worst, std::abs(c[lane] - std::cos(static_cast<long double>(x[lane]))));
      }
    }
    EXPECT_LT(worst, 2.3e-16L) << range;
  }
  Doubles x(kNan), s, c;
  x.Set(3, kInfinity);
  SinCos(x, s, c);
  for (int lane = 0; lane < 8; ++lane) EXPECT_TRUE(std::isnan(s[lane]) && std::isnan(c[lane]));
}

TEST(Elementary, SignOfFloat_IsThatOfItsComparisons) {
  for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << 32); bits += 251) {  // every exponent, both signs, NaN
    const float x = FloatOf(static_cast<std::uint32_t>(bits));
    ASSERT_EQ(BitsOf(Sign(x)), BitsOf(static_cast<float>((x > 0) - (x < 0)))) << bits;
  }
  for (const std::uint32_t bits :
       {0u, 0x80000000u, 1u, 0x80000001u, 0x7F800000u, 0xFF800000u, 0x7F800001u, 0xFFC00000u})
    EXPECT_EQ(BitsOf(Sign(FloatOf(bits))), BitsOf(static_cast<float>((FloatOf(bits) > 0) - (FloatOf(bits) < 0))))
        << bits;
}

// The whole generated regressor, a different state in every lane, against the scalar one.
template <class P>
void ExpectRegressorOfLanes(double tolerance) {
  using Model = generated::Er20Like;
  using T = decltype(P()[0]);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-3, 3);
  model::ModelInput<P, 6> x = {};
  for (P* v : {x.q, x.qd, x.qdd})
    for (int j = 0; j < 6; ++j)
      for (int lane = 0; lane < P::kLanes; ++lane) v[j].Set(lane, static_cast<T>(any(random)));
  P front[Model::kFront], dense[6 * Model::kDense];
  for (P& d : dense) d = P(0);
  Model::Regressor<P>(x, nullptr, nullptr, nullptr, nullptr, front, dense);
  for (int lane = 0; lane < P::kLanes; ++lane) {
    model::ModelInput<T, 6> one = {};
    for (int j = 0; j < 6; ++j) one.q[j] = x.q[j][lane], one.qd[j] = x.qd[j][lane], one.qdd[j] = x.qdd[j][lane];
    T f[Model::kFront] = {}, d[6 * Model::kDense] = {};
    Model::Regressor<T>(one, nullptr, nullptr, nullptr, nullptr, f, d);
    for (int c = 0; c < Model::kFront; ++c) EXPECT_EQ(front[c][lane], f[c]);
    for (int k = 0; k < 6 * Model::kDense; ++k)
      EXPECT_NEAR(static_cast<double>(dense[k][lane]), static_cast<double>(d[k]), tolerance) << k;
  }
}

TEST(Pack, GeneratedRegressor_GivesEachLaneItsOwnState) {
  // Entries reach 100; sines differ by one rounding, and a fused product of scalars by another: some 30 roundings.
  ExpectRegressorOfLanes<Doubles>(100 * 30 * 1.1e-16);
  ExpectRegressorOfLanes<Floats>(100 * 30 * 6e-8);
}

}  // namespace
}  // namespace armcal::math
