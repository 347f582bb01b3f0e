// filter - long runs of both forms on collinear rows of the six-joint size; knows no model.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <random>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using test::Matrix;
using test::Vector;

// 36 base columns and three friction columns a joint.
struct SixAxis {
  static constexpr int kJoints = 6, kFront = 18, kDense = 36, kColumns = 54, kNonlinear = 0;
  static constexpr int kFrontBegin[7] = {0, 3, 6, 9, 12, 15, 18};
  static constexpr int kRowBegin[6] = {0, 1, 8, 15, 22, 29};
};

// Dense columns of a row mixed by a matrix of the given condition: collinear, not only badly scaled.
struct Collinear {
  std::mt19937 random{5};
  std::normal_distribution<float> normal;
  Matrix mix;  // block upper: keeps the leading zeros of each row
  Vector truth;
  explicit Collinear(double condition) {
    const auto any = [&] { return static_cast<double>(normal(random)); };
    mix = Matrix::Zero(SixAxis::kDense, SixAxis::kDense);
    const int begin[8] = {0, 1, 8, 15, 22, 29, 36};
    for (int b = 0; b < 6; ++b) {
      const int size = begin[b + 1] - begin[b];
      const Matrix q1 = Eigen::HouseholderQR<Matrix>(Matrix::NullaryExpr(size, size, any)).householderQ();
      const Matrix q2 = Eigen::HouseholderQR<Matrix>(Matrix::NullaryExpr(size, size, any)).householderQ();
      Vector s(size);
      for (int k = 0; k < size; ++k) s(k) = std::pow(condition, size > 1 ? -static_cast<double>(k) / (size - 1) : 0.0);
      mix.block(begin[b], begin[b], size, size) = q1 * s.asDiagonal() * q2;
    }
    truth = Vector::NullaryExpr(SixAxis::kColumns, any);
  }
  void Next(int joint, float* front, float* dense, float& y) {
    constexpr float kSize = 30.0f;  // torque of one prior standard deviation over torque noise
    Vector row = Vector::Zero(SixAxis::kDense);
    for (int k = SixAxis::kRowBegin[joint]; k < SixAxis::kDense; ++k) row(k) = kSize * normal(random);
    row = mix.transpose() * row;
    double sum = normal(random);
    for (int k = 0; k < SixAxis::kDense; ++k) {
      dense[k] = static_cast<float>(row(k));
      sum += dense[k] * truth(SixAxis::kFront + k);
    }
    for (int k = 0; k < 3; ++k) {
      front[k] = kSize * normal(random);
      sum += front[k] * truth(3 * joint + k);
    }
    y = static_cast<float>(sum);
  }
};

Prior<SixAxis> Independent(float lambda) {
  Prior<SixAxis> prior;
  for (int k = 0; k < SixAxis::kColumns; ++k) {
    prior.active[k] = ~0u;
    prior.lambda[k] = lambda;
    prior.noise[k] = k < SixAxis::kFront ? 1e-8f : 0.0f;
  }
  for (int k = 0; k < SixAxis::kDense; ++k) prior.dense_ud[math::UdIndex(k, k)] = 1.0f;
  prior.link_floor = 1e-9f;
  return prior;
}

class LongRun : public testing::TestWithParam<double> {};

TEST_P(LongRun, HundredThousandSamples_KeepDPositiveAndTheTruthInside) {
  constexpr std::uint32_t kAll = 63;
  const Prior<SixAxis> prior = Independent(0.9995f);
  auto kalman = std::make_unique<KalmanFilter<SixAxis>>();
  auto forgetting = std::make_unique<ForgettingFilter<SixAxis>>();
  kalman->Restart(prior);
  forgetting->Restart(prior);
  Collinear rows(GetParam());
  float front[3], dense[SixAxis::kDense], y;
  for (int s = 0; s < 100000; ++s) {
    const int j = s % 6;  // one joint a sample, in turn
    rows.Next(j, front, dense, y);
    ASSERT_TRUE(kalman->Update(j, front, dense, y, true).accepted);
    ASSERT_TRUE(forgetting->Update(j, front, dense, y, true).accepted);
    kalman->EndSample(kAll);
    forgetting->EndSample(kAll);
    for (int k = 0; k < SixAxis::kColumns; ++k) ASSERT_GT(kalman->estimate().d(k), 0.0f) << s;
  }
  const auto a = test::Read(*kalman);
  const auto b = test::Read(*forgetting);
  double sum_a = 0, sum_b = 0;
  for (int k = 0; k < SixAxis::kColumns; ++k) {
    const double ea = (a.x[k] - rows.truth(k)) / a.sd[k], eb = (b.x[k] - rows.truth(k)) / b.sd[k];
    EXPECT_LT(std::abs(ea), 5) << k;
    EXPECT_LT(std::abs(eb), 6) << k;
    sum_a += ea * ea;
    sum_b += eb * eb;
  }
  // Mean square near one; exponential forgetting states half the variance it has. 54 columns: one is +-0.2, three of
  // it.
  EXPECT_LT(sum_a / SixAxis::kColumns, 1.6);
  EXPECT_LT(sum_b / SixAxis::kColumns, 1.6);
}

INSTANTIATE_TEST_SUITE_P(Condition, LongRun, testing::Values(1e3, 1e4, 1e5));

}  // namespace
}  // namespace armcal::filter
