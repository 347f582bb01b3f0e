// physical - steps and barrier of one body against dense 4 x 4 algebra and differences.
#include "armcal/physical/body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace armcal::physical {
namespace {

using Vector10 = Eigen::Matrix<double, 10, 1>;

const double kBody[10] = {3.0, 0.2, -0.1, 0.3, 0.05, 0.01, -0.02, 0.06, 0.005, 0.04};  // central, inside the cone

Eigen::Matrix4d PseudoInertia(const Vector10& body) {  // about the origin
  Eigen::Matrix3d inertia;
  inertia << body(4), body(5), body(6), body(5), body(7), body(8), body(6), body(8), body(9);
  Eigen::Matrix4d j;
  j.topLeftCorner<3, 3>() = 0.5 * inertia.trace() * Eigen::Matrix3d::Identity() - inertia;
  j.topRightCorner<3, 1>() = body.segment<3>(1);
  j.bottomLeftCorner<1, 3>() = body.segment<3>(1).transpose();
  j(3, 3) = body(0);
  return j;
}
Vector10 ToOrigin(const double* central) {
  Vector10 body;
  FromCentral(central, body.data());
  return body;
}
Eigen::Matrix<double, 10, 10, Eigen::RowMajor> Jacobian() {
  Eigen::Matrix<double, 10, 10, Eigen::RowMajor> jacobian;
  BodyJacobian(kBody[0], kBody + 1, jacobian.data());
  return jacobian;
}
Vector10 Moved(const Vector10& move) {
  const bool held[10] = {};
  Vector10 moved;
  Move(kBody, move.data(), held, moved.data());
  return moved;
}

TEST(Central, PullBack_IsTheTransposedJacobian) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Vector10 g = Vector10::NullaryExpr([&] { return normal(random); });
  Vector10 pulled;
  PullBack(kBody[0], kBody + 1, g.data(), pulled.data());
  EXPECT_LT((pulled - Jacobian().transpose() * g).norm(), 1e-14);
}

TEST(Central, Move_OfAnySize_IsStraightAboutTheOrigin) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 0.3);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector10 move = Vector10::NullaryExpr([&] { return normal(random); });
    EXPECT_LT((ToOrigin(Moved(move).data()) - ToOrigin(kBody) - Jacobian() * move).norm(), 1e-13);
  }
}

TEST(Central, Move_WithAHeldInertia_KeepsItsBits) {
  Vector10 move = Vector10::Constant(0.1), moved;
  bool held[10] = {};
  held[7] = true;
  move(7) = 0;
  Move(kBody, move.data(), held, moved.data());
  EXPECT_EQ(moved(7), kBody[7]);
  EXPECT_NE(moved(4), kBody[4] + 0.1);  // the others follow the centre
}

TEST(Central, ConeDeterminant_IsThatOfThePseudoInertia_AndZeroOutside) {
  EXPECT_NEAR(ConeDeterminant(kBody, 0.0) / PseudoInertia(ToOrigin(kBody)).determinant(), 1, 1e-12);
  for (const int k : {0, 4, 5, 7, 9}) {
    double outside[10];
    std::copy(kBody, kBody + 10, outside);
    outside[k] += k == 0 ? -3.1 : 0.3;
    EXPECT_EQ(ConeDeterminant(outside, 0.0), 0.0) << k;
  }
  EXPECT_EQ(ConeDeterminant(kBody, 0.1), 0.0);  // S is nowhere as large as that
}

TEST(Central, Barrier_HasTheDerivativesOfLogDetAlongAMove) {
  const double margin = 0.003;
  const auto cost = [&](const Vector10& move) {
    // The margin makes the second moments about the centre smaller, wherever the centre is.
    Vector10 body = ToOrigin(Moved(move).data());
    Eigen::Matrix4d j = PseudoInertia(body);
    j.topLeftCorner<3, 3>() -= margin * Eigen::Matrix3d::Identity();
    return -std::log(j.determinant());
  };
  constexpr double kStep = 1e-5;  // second differences: roundings of 1e-16 / step^2 against errors of order step^2
  for (int a = 0; a < 10; ++a) {
    const Vector10 da = kStep * Vector10::Unit(a);
    double column[10];
    const double first = BarrierDerivatives(kBody, margin, a, column);
    EXPECT_NEAR(first, (cost(da) - cost(-da)) / (2 * kStep), 1e-5 * (1 + std::abs(first))) << a;
    for (int b = 0; b < 10; ++b) {
      const Vector10 db = kStep * Vector10::Unit(b);
      const double second = (cost(da + db) - cost(da - db) - cost(db - da) + cost(-da - db)) / (4 * kStep * kStep);
      EXPECT_NEAR(column[b], second, 1e-4 * (10 + std::abs(second))) << a << b;
    }
  }
}

}  // namespace
}  // namespace armcal::physical
