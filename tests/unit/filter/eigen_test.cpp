// filter - Eigen's views: the numbers are the library's own, a block is the covariance, and a wrong size ends in a
// trap.
#include "armcal/eigen.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "armcal/filter/kalman_filter.hpp"

namespace {

using namespace armcal;

// Two joints with two front columns each, and three dense ones.
struct Layout {
  static constexpr int kJoints = 2, kFront = 4, kDense = 3, kColumns = 7, kNonlinear = 0;
  static constexpr int kFrontBegin[3] = {0, 2, 4};
  static constexpr int kRowBegin[2] = {0, 1};
};
using Exact = Eigen::Matrix<double, Layout::kColumns, Layout::kColumns>;

TEST(EigenViews, OfAnArray_AreTheArrayItself) {
  float q[3] = {1, 2, 3};
  const float qd[3] = {4, 5, 6};
  eigen::View(q) += 2.0f * eigen::View(qd);
  EXPECT_EQ(q[0], 9.0f);
  EXPECT_EQ(q[2], 15.0f);
  EXPECT_EQ(eigen::View(q).data(), q);
}

// The oracle adds information in double: P = (1 + sum of h h')^-1.
template <class Filter>
void CompareBlock() {
  filter::Prior<Layout> prior;
  for (int k = 0; k < Layout::kColumns; ++k) prior.active[k] = ~0u, prior.lambda[k] = 1.0f;
  for (int k = 0; k < Layout::kDense; ++k) prior.dense_ud[math::UdIndex(k, k)] = 1.0f;
  Filter filter;
  filter.Restart(prior);
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  Exact information = Exact::Identity();
  for (int row = 0; row < 40; ++row) {
    const int joint = row % 2;
    float front[Layout::kFront] = {}, dense[Layout::kDense] = {};
    Eigen::Matrix<double, Layout::kColumns, 1> h = Eigen::Matrix<double, Layout::kColumns, 1>::Zero();
    for (int k = 0; k < 2; ++k) h[2 * joint + k] = front[k] = normal(random);
    for (int k = Layout::kRowBegin[joint]; k < Layout::kDense; ++k) h[Layout::kFront + k] = dense[k] = normal(random);
    (void)filter.Update(joint, front, dense, 0.0f, true);
    information += h * h.transpose();
  }
  const Exact covariance = information.inverse();
  const float scale[Layout::kColumns] = {1, 2, 3, 4, 5, 6, 7};
  const int columns[3] = {1, 6, 2};
  Eigen::Matrix3f block;
  eigen::CovarianceBlock<Filter, 3> sum;
  sum.Begin(columns, scale, block);
  int calls = 1;
  for (; !sum.Step(filter, 2); ++calls) {
  }
  EXPECT_EQ(calls, 4);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int a = columns[i], b = columns[j];
      const double unit = static_cast<double>(scale[a]) * static_cast<double>(scale[b]);
      EXPECT_NEAR(block(i, j), unit * covariance(a, b),
                  1e-5 * unit * std::sqrt(covariance(a, a) * covariance(b, b)));  // float32
    }
}

TEST(EigenViews, BlockOfTheDenseForm_IsTheCovariance) { CompareBlock<filter::KalmanFilter<Layout>>(); }
TEST(EigenViews, BlockOfTheBlockForm_IsTheCovariance) {
  CompareBlock<filter::KalmanFilter<Layout, filter::Form::kBlock>>();
}

// Also in a build with NDEBUG.
TEST(EigenViewsDeathTest, AnIndexBeyondTheEnd_EndsInTheTrap) {
  float q[3] = {1, 2, 3};
  volatile int index = 3;
  EXPECT_DEATH(eigen::View(q)(index) = 1.0f, "");
}

}  // namespace
