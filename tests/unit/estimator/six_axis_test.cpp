// estimator - both filters on a generated six-axis model, float32 against the dense double oracle.
#include <gtest/gtest.h>

#include <random>

#include "armcal/estimator/physical_read_out.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/estimator/oracle.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using Model = generated::Er20Like;
using SixAxisSample = model::Sample<6>;

// A truth drawn from the table's own prior.
Vector DrawTruth(const Table<Model>& table, const Vector& b0) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  const Matrix p = PriorCovariance<Model>(table);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(p);
  const Vector z = Vector::NullaryExpr(Model::kColumns, [&] { return normal(random); });
  return b0 + eigen.eigenvectors() * (eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * z);
}

std::vector<SixAxisSample> Record(const Vector& truth, int count) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<SixAxisSample> samples(count);
  const double tone[6] = {0.9, 1.1, 1.3, 1.9, 2.3, 2.9}, size[6] = {1.0, 0.5, 0.7, 0.9, 0.9, 1.2};
  for (int k = 0; k < count; ++k) {
    SixAxisSample& s = samples[k];
    s.tick = k * Model::kSampleTicks;
    const double t = s.tick * 1e-3;
    for (int i = 0; i < 6; ++i) {
      double motion[3] = {};
      for (int h = 1; h <= 3; ++h) {
        const double w = h * tone[i], a = size[i] / (h * h), phase = 0.7 * i + h;
        motion[0] += a * std::sin(w * t + phase);
        motion[1] += a * w * std::cos(w * t + phase);
        motion[2] -= a * w * w * std::sin(w * t + phase);
      }
      s.q[i] = static_cast<float>(motion[0]);
      s.qd[i] = static_cast<float>(motion[1]);
      s.qdd[i] = static_cast<float>(motion[2]);
      s.flags[i] = static_cast<std::uint8_t>(model::kValid |
                                             (std::abs(s.qd[i]) > Model::kAxes[i].v_min_radps ? model::kMoving : 0));
    }
    const Vector tau = Regressor<Model>(s) * truth;
    for (int i = 0; i < 6; ++i) s.tau[i] = static_cast<float>(tau(i) + Model::kAxes[i].sigma_Nm * normal(random));
  }
  return samples;
}

template <class Filter>
class SixAxis : public testing::Test {};
using SixAxisFilters = testing::Types<filter::ForgettingFilter<Model>, filter::KalmanFilter<Model>>;
TYPED_TEST_SUITE(SixAxis, SixAxisFilters);

TYPED_TEST(SixAxis, FortySeconds_AreTheBatchSolutionWithinATenthOfSigma) {
  auto host = std::make_unique<Host<Model, TypeParam>>();
  for (float& lambda : host->table.forgetting) lambda = 1;
  for (model::ParameterEntry& p : host->table.parameter) p.process_noise = 0;
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  const Vector truth = DrawTruth(host->table, host->b0());
  const std::vector<SixAxisSample> samples = Record(truth, 40 * 125);
  for (const SixAxisSample& s : samples) ASSERT_EQ(host->Feed(s), core::Status::kOk);
  const Oracle<Model> oracle(host->table, host->b0(), samples);
  const Estimates<Model>& e = host->Read();
  EXPECT_LT(oracle.Distance(e.value), 0.1);
  double square = 0;
  for (const int k : oracle.active) {
    EXPECT_NEAR(e.sd[k] / oracle.sd(k), 1, 0.02) << k;
    square += std::pow((e.value[k] - truth(k)) / e.sd[k], 2) / static_cast<double>(oracle.active.size());
  }
  EXPECT_LT(square, 2);  // 52 normal squares: mean 1, deviation 0.2
}

TEST(SixAxis, PhysicalReadOut_OfBothFilters_IsTheSameArmAndNearerToTheTruthThanTheTable) {
  auto kalman = std::make_unique<Host<Model, filter::KalmanFilter<Model>>>();
  auto forgetting = std::make_unique<Host<Model, filter::ForgettingFilter<Model>>>();
  for (model::ParameterEntry& p : kalman->table.parameter) p.process_noise = 0;
  for (float& lambda : forgetting->table.forgetting) lambda = 1;
  ASSERT_EQ(kalman->Adopt(), core::Status::kOk);
  ASSERT_EQ(forgetting->Adopt(), core::Status::kOk);
  const Vector truth = DrawTruth(kalman->table, kalman->b0());
  for (const SixAxisSample& s : Record(truth, 10 * 125)) {
    ASSERT_EQ(kalman->Feed(s), core::Status::kOk);
    ASSERT_EQ(forgetting->Feed(s), core::Status::kOk);
  }
  using ReadOut = physical::MapReadOut<Model, double>;
  auto one = std::make_unique<ReadOut>(), two = std::make_unique<ReadOut>();
  const auto begin = [](auto& host, ReadOut& out) {
    host.Read();
    return HandOverPhysical(host.adopted, host.rigid, host.estimator, false, out);
  };
  ASSERT_EQ(begin(*kalman, *one), core::Status::kOk);
  ASSERT_EQ(begin(*forgetting, *two), core::Status::kOk);
  while (!one->Step() || !two->Step()) {
  }
  const auto &a = one->result(), &b = two->result();
  ASSERT_TRUE(a.converged && b.converged);
  for (int k = 0; k < Model::kBodyParameters; ++k) {
    EXPECT_NEAR(a.body_sd[k], b.body_sd[k], 0.02 * a.body_sd[k]) << k;
    EXPECT_LE(a.body_sd[k], 1.001 * kalman->rigid.sd[k]) << k;
  }
  double before = 0, after = 0;
  for (int k = 0; k < Model::kColumns; ++k) {
    if (!(a.column_sd[k] > 0)) continue;
    EXPECT_NEAR(a.column[k], b.column[k], 0.1 * a.column_sd[k]) << k;
    before += std::pow((kalman->b0()(k) - truth(k)) / a.column_sd[k], 2);
    after += std::pow((a.column[k] - truth(k)) / a.column_sd[k], 2);
  }
  EXPECT_LT(after, 0.02 * before);
}

// Otherwise the columns of two estimates would be mixed.
TEST(SixAxis, AHandOverThatASampleInterrupts_BeginsAgain) {
  auto host = std::make_unique<Host<Model, filter::KalmanFilter<Model>>>();
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  const auto samples = Record(DrawTruth(host->table, host->b0()), 3);
  ASSERT_EQ(host->Feed(samples[0]), core::Status::kOk);
  host->Read();
  auto out = std::make_unique<physical::MapReadOut<Model, double>>();
  const auto begin = [&] { return BeginPhysical(host->adopted, host->rigid, host->estimator, false, *out); };
  const auto go_on = [&] { return ContinuePhysical(host->estimator, *out); };
  EXPECT_EQ(begin(), core::Status::kOk);
  EXPECT_EQ(go_on(), core::Status::kBusy);
  ASSERT_EQ(host->Feed(samples[1]), core::Status::kOk);
  EXPECT_EQ(begin(), core::Status::kBusy) << "there is no finished read-out";
  EXPECT_EQ(go_on(), core::Status::kWrongOrder);
  host->Read();
  EXPECT_EQ(go_on(), core::Status::kWrongOrder) << "the read-out is a later one";
  EXPECT_EQ(begin(), core::Status::kOk);
  int columns = 1;
  for (; go_on() == core::Status::kBusy; ++columns) {
  }
  EXPECT_EQ(columns, Model::kColumns);
}

}  // namespace
}  // namespace armcal::estimator
