// filter - 10 000 samples of collinear rows, float32 against the same recursions in double.
#include "tests/unit/filter/stress.hpp"

namespace armcal::filter {
namespace {
using test::Stress;
constexpr int kSamples = 10000;

class Condition : public testing::TestWithParam<double> {};

TEST_P(Condition, WithNoiseAndForgetting_BothStayBesideTheRecursionsInDouble) {
  Stress stress(GetParam(), 0.999f, 1e-6f, 1e-6f);
  for (int s = 0; s < kSamples; ++s) stress.Sample();
  EXPECT_LT(stress.KalmanDistance(), 0.2);
  EXPECT_LT(stress.ForgettingDistance(), 0.05);
}

TEST_P(Condition, WithoutNoiseAndForgetting_BothAreTheBatchSolution) {
  Stress stress(GetParam(), 1.0f, 0.0f, 0.0f);
  for (int s = 0; s < kSamples; ++s) stress.Sample();
  const test::Posterior batch = stress.triangle_oracle.Solve();  // in double, all rows and the prior
  EXPECT_LT(test::Distance<test::SixAxis>(test::Read(*stress.kalman).x, batch), 0.1);
  EXPECT_LT(test::Distance<test::SixAxis>(test::Read(*stress.forgetting).x, batch), 0.1);
  // The truth lies where the standard deviations say: mean square near one; 54 columns: +-0.2, three of it.
  const auto out = test::Read(*stress.kalman);
  double square = 0;
  for (int k = 0; k < Stress::n; ++k) square += std::pow((out.x[k] - stress.rows.truth(k)) / out.sd[k], 2) / Stress::n;
  EXPECT_LT(square, 1.6);
}

INSTANTIATE_TEST_SUITE_P(Of, Condition, testing::Values(1e3, 1e4, 1e5));

}  // namespace
}  // namespace armcal::filter
