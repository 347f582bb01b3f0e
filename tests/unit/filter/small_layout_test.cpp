// filter - what every filter must also be: usable with one joint and without dense columns, and free of initial bytes.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstring>
#include <memory>
#include <new>
#include <random>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {

// One joint whose columns all touch its own row alone.
struct OneJoint {
  static constexpr int kJoints = 1, kFront = 3, kDense = 0, kColumns = 3, kNonlinear = 0;
  static constexpr int kFrontBegin[2] = {0, 3};
  static constexpr int kRowBegin[1] = {0};
};

template <class Filter>
struct SmallLayout : testing::Test {};
using SmallFilters = testing::Types<ForgettingFilter<OneJoint>, KalmanFilter<OneJoint>,
                                    KalmanFilter<OneJoint, Form::kBlock>, ExtendedKalmanFilter<OneJoint>>;
TYPED_TEST_SUITE(SmallLayout, SmallFilters);

// The oracle: normal equations with a unit prior, in double.
TYPED_TEST(SmallLayout, OneJointWithoutDenseColumns_IsLeastSquares) {
  Prior<OneJoint> prior;
  for (int k = 0; k < 3; ++k) prior.active[k] = ~0u, prior.lambda[k] = 1.0f;
  TypeParam filter;
  filter.Restart(prior);
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int row = 0; row < 40; ++row) {
    const float front[3] = {normal(random), normal(random), 1.0f}, none[1] = {}, y = 2 * normal(random);
    EXPECT_TRUE(filter.Update(0, front, none, y, true).accepted);
    filter.EndSample(1);
    const Eigen::Vector3d h(front[0], front[1], front[2]);
    information += h * h.transpose();
    sum += y * h;
  }
  const auto out = test::Read(filter);
  const Eigen::Vector3d x = information.ldlt().solve(sum);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(out.x[k], x[k], 1e-4);
    EXPECT_NEAR(out.sd[k], std::sqrt(information.inverse()(k, k)), 1e-4);
  }
}

// A static object whose bytes all start at zero needs no flash for them.
template <class T>
bool StartsAtZero() {
  const auto room = std::make_unique<unsigned char[]>(sizeof(T) + alignof(T));
  void* place = room.get();
  std::size_t space = sizeof(T) + alignof(T);
  std::align(alignof(T), sizeof(T), place, space);
  std::memset(place, 0, sizeof(T));
  T* object = new (place) T;
  bool zero = true;
  for (std::size_t k = 0; k < sizeof(T); ++k) zero &= static_cast<const unsigned char*>(place)[k] == 0;
  object->~T();
  return zero;
}

TEST(StaticFilters, StartAsZeros) {
  using test::Small;
  EXPECT_TRUE(StartsAtZero<ForgettingFilter<Small>>());
  EXPECT_TRUE(StartsAtZero<ForgettingFilter<Small>::ReadOut>());
  EXPECT_TRUE(StartsAtZero<KalmanFilter<Small>>());
  EXPECT_TRUE((StartsAtZero<KalmanFilter<Small, Form::kBlock>>()));
  EXPECT_TRUE((StartsAtZero<KalmanFilter<Small, Form::kBlock>::ReadOut>()));
  EXPECT_TRUE(StartsAtZero<ExtendedKalmanFilter<Small>>());
  EXPECT_TRUE(StartsAtZero<ModelBank<Small>>());
}

}  // namespace
}  // namespace armcal::filter
