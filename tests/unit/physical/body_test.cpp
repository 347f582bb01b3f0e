// physical - bodies against point masses and Eigen's eigenvalues.
#include "armcal/physical/body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>

namespace armcal::physical {
namespace {

using Vector10 = Eigen::Matrix<double, 10, 1>;

// A body of point masses: physical by construction.
Vector10 PointMasses(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> place(-0.4, 0.6), mass(0.1, 3.0);
  Vector10 body = Vector10::Zero();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d r(place(random), place(random), place(random));
    const double m = mass(random);
    const Eigen::Matrix3d inertia = m * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
    Vector10 point;
    point << m, m * r, inertia(0, 0), inertia(0, 1), inertia(0, 2), inertia(1, 1), inertia(1, 2), inertia(2, 2);
    body += point;
  }
  return body;
}

// Independent judgement: mass, and principal moments about the centre with the triangle inequality.
bool PhysicalByEigenvalues(const Vector10& b) {
  const Eigen::Vector3d c = b.segment<3>(1) / b(0);
  Eigen::Matrix3d inertia;
  inertia << b(4), b(5), b(6), b(5), b(7), b(8), b(6), b(8), b(9);
  inertia -= b(0) * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  const Eigen::Vector3d e = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues();
  return b(0) > 0 && e(0) > 0 && e(0) + e(1) > e(2);
}

TEST(Physical, LinkWhoseRotorInertiaIsNegativeOrNoNumber_CannotExist) {
  double link[11] = {2, 0, 0, 0, 1, 0, 0, 1, 0, 1, 0};
  EXPECT_TRUE(CanExist(link));
  link[10] = -1e-9;
  EXPECT_FALSE(CanExist(link));
  link[10] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(CanExist(link));
}

TEST(Physical, BodyOfPointMasses_IsPhysicalInFloatAndDouble) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector10 body = PointMasses(random, 6);
    const Eigen::Matrix<float, 10, 1> small = body.cast<float>();
    EXPECT_TRUE(IsPhysical(body.data()));
    EXPECT_TRUE(IsPhysical(small.data()));
  }
}

TEST(Physical, RandomlySpoiltBody_IsJudgedAsItsEigenvaluesSay) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  int good = 0, bad = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    Vector10 body = PointMasses(random, 5);
    for (int k = 0; k < 10; ++k) body(k) *= 1 + 0.15 * normal(random);
    const bool expected = PhysicalByEigenvalues(body);
    (expected ? good : bad)++;
    EXPECT_EQ(IsPhysical(body.data()), expected) << body.transpose();
  }
  EXPECT_GT(good, 500);
  EXPECT_GT(bad, 500);
}

TEST(Physical, FlatEmptyNegativeOrNotANumber_IsNotPhysical) {
  const float empty[10] = {};
  EXPECT_FALSE(IsPhysical(empty));
  const float rod[10] = {1, 0, 0, 0, 0, 0, 0, 1, 0, 1};  // all mass on the x axis
  EXPECT_FALSE(IsPhysical(rod));
  const float negative[10] = {-1, 0, 0, 0, 1, 0, 0, 1, 0, 1};
  EXPECT_FALSE(IsPhysical(negative));
  float nan[10] = {1, 0, 0, 0, 1, 0, 0, 1, 0, 1};
  EXPECT_TRUE(IsPhysical(nan));
  nan[8] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(IsPhysical(nan));
}

TEST(Physical, SurveysPrintedLink3_IsNotPhysical) {
  const double central[10] = {25.6083, .0938, .1383, .1164, .1706, -.1498, .2140, .3493, -.1320, .2363};
  double body[10];
  FromCentral(central, body);
  EXPECT_FALSE(IsPhysical(body));
}

TEST(Physical, CentralAndBack_IsTheIdentity_AndMatchesThePointMasses) {
  std::mt19937 random(5);
  const Vector10 body = PointMasses(random, 4);
  Vector10 central, back;
  ToCentral(body.data(), central.data());
  FromCentral(central.data(), back.data());
  EXPECT_LT((back - body).norm(), 1e-13);
  EXPECT_TRUE(PhysicalByEigenvalues(body));
  EXPECT_NEAR(central(1), body(1) / body(0), 1e-15);
}

TEST(Physical, Jacobian_IsTheDerivativeOfFromCentral) {
  std::mt19937 random(6);
  const Vector10 body = PointMasses(random, 4);
  Vector10 central;
  ToCentral(body.data(), central.data());
  Eigen::Matrix<double, 10, 10, Eigen::RowMajor> jacobian;
  BodyJacobian(central(0), central.data() + 1, jacobian.data());
  for (int k = 0; k < 10; ++k) {
    constexpr double kStep = 1e-6;
    Vector10 up = central, down = central, body_up, body_down;
    up(k) += kStep;
    down(k) -= kStep;
    FromCentral(up.data(), body_up.data());
    FromCentral(down.data(), body_down.data());
    // Central differences of a cubic: error of order step^2, roundings of order 1e-16 / step.
    EXPECT_LT((jacobian.col(k) - (body_up - body_down) / (2 * kStep)).norm(), 1e-8) << k;
  }
}

}  // namespace
}  // namespace armcal::physical
