// estimator - float32 estimates against dense double oracles over 40 s at 125 Hz.
#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using filter::ForgettingFilter;
using filter::KalmanFilter;

constexpr int kFortySeconds = 40 * 125;

std::vector<Sample> Record(int count) {
  Motion run;
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) samples.push_back(run.Next(k >= 2000 && k < 2500));
  return samples;
}
void WithoutNoise(Table<TwoLink>& table) {
  for (model::ParameterEntry& p : table.parameter) p.process_noise = 0;
}

template <class Filter>
class Batch : public testing::Test {};
using Filters = testing::Types<ForgettingFilter<TwoLink>, KalmanFilter<TwoLink>>;
TYPED_TEST_SUITE(Batch, Filters);

TYPED_TEST(Batch, FortySeconds_AreTheBatchSolutionWithinATenthOfSigma) {
  auto host = std::make_unique<Host<TwoLink, TypeParam>>();
  WithoutNoise(host->table);
  for (const int k : {24, 27, 28, 29})
    host->table.parameter[k].state = model::ParameterState::kEstimated;  // all effects
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  const std::vector<Sample> samples = Record(kFortySeconds);
  for (const Sample& s : samples) ASSERT_EQ(host->Feed(s), core::Status::kOk);
  const Oracle<TwoLink> oracle(host->table, host->b0(), samples);
  const Estimates<TwoLink>& e = host->Read();
  ASSERT_EQ(oracle.active.size(), static_cast<std::size_t>(kColumns));
  EXPECT_LT(oracle.Distance(e.value), 0.1);
  for (const int k : oracle.active) {
    EXPECT_NEAR(e.sd[k] / oracle.sd(k), 1, 0.01) << k;
    EXPECT_LT(std::abs(e.value[k] - Motion().truth(k)) / e.sd[k], 4) << k;
  }
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(e.nis[i], 1, 0.15) << i;
}

TEST(Accuracy, Forgetting_IsTheGatedQrRecursionWithinATenthOfSigma) {
  auto host = std::make_unique<Host<TwoLink, ForgettingFilter<TwoLink>>>();
  host->table.forgetting[0] = 0.9995f;
  host->table.forgetting[1] = 0.998f;
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  std::vector<double> lambda(host->adopted.prior.lambda, host->adopted.prior.lambda + kColumns);
  const std::vector<Sample> samples = Record(kFortySeconds);
  for (const Sample& s : samples) ASSERT_EQ(host->Feed(s), core::Status::kOk);
  const Oracle<TwoLink> oracle(host->table, host->b0(), samples, lambda);
  EXPECT_LT(oracle.Distance(host->Read().value), 0.1);
}

// One column of joint 2 with the wrong sign: a generator's classic fault.
struct WrongSign : TwoLink {
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    TwoLink::Regressor(x, committed, eta, state, next, front, dense);
    dense[kDense + 4] = -dense[kDense + 4];
  }
};

template <class Model>
double DistanceOfRun(bool lose_row, bool ungate_rest) {
  auto host = std::make_unique<Host<Model, ForgettingFilter<Model>>>();
  EXPECT_EQ(host->Adopt(), core::Status::kOk);
  const std::vector<Sample> samples = Record(2500);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    Sample s = samples[k];
    if (lose_row && k == 700) s.flags[1] = 0;
    if (ungate_rest) s.flags[0] |= model::kMoving;
    EXPECT_EQ(host->Feed(s), core::Status::kOk);
  }
  return Oracle<TwoLink>(DefaultTable<TwoLink>(), host->b0(), samples).Distance(host->Read().value);
}

TEST(Accuracy, PlantedFaults_AreFarFromTheOracle) {
  const double sound = DistanceOfRun<TwoLink>(false, false);
  EXPECT_LT(sound, 0.01);
  EXPECT_GT(DistanceOfRun<WrongSign>(false, false), 10);
  EXPECT_GT(DistanceOfRun<TwoLink>(true, false), 3 * sound);  // one row of 4000
  EXPECT_GT(DistanceOfRun<TwoLink>(false, true), 1);
}

TEST(Accuracy, KalmanWithNoise_FollowsAFrictionThatChanges) {
  auto host = std::make_unique<Host<TwoLink, KalmanFilter<TwoLink>>>();
  for (const int k : {22, 23, 25, 26}) host->table.parameter[k].process_noise = 1e-4f;
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  Motion run;
  for (int k = 0; k < kFortySeconds; ++k) {
    if (k == kFortySeconds / 2) run.truth(1) = 6;  // viscous friction of joint 1
    ASSERT_EQ(host->Feed(run.Next()), core::Status::kOk);
  }
  const Estimates<TwoLink>& e = host->Read();
  EXPECT_LT(std::abs(e.value[1] - 6), 4 * e.sd[1]);
  EXPECT_LT(e.sd[1], 0.3);
}

}  // namespace
}  // namespace armcal::estimator
