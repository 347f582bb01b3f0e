// physical - base coordinates against the standard-parameter Kalman filter, in double.
#include "armcal/physical/rigid_prior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <random>

namespace armcal::physical {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Two links, a full random base map of nine rows.
struct RandomMap {
  static constexpr int kJoints = 2, kRigid = 9, kBodyParameters = 22;
  static inline int kMapBegin[kRigid + 1];
  static inline int kMapColumn[kRigid * kBodyParameters];
  static inline float kMapValue[kRigid * kBodyParameters];
};
using Prior = RigidPrior<RandomMap, double>;

struct RigidPriorTest : testing::Test {
  std::mt19937 random{9};
  std::normal_distribution<double> normal;
  std::unique_ptr<Prior> prior = std::make_unique<Prior>();
  Matrix b{RandomMap::kRigid, RandomMap::kBodyParameters};
  Matrix p0;  // of the bodies about the link origins

  RigidPriorTest() {
    for (int r = 0; r < RandomMap::kRigid; ++r) {
      RandomMap::kMapBegin[r] = r * RandomMap::kBodyParameters;
      for (int k = 0; k < RandomMap::kBodyParameters; ++k) {
        const int e = r * RandomMap::kBodyParameters + k;
        RandomMap::kMapColumn[e] = k;
        RandomMap::kMapValue[e] = static_cast<float>(normal(random));
        b(r, k) = RandomMap::kMapValue[e];
      }
    }
    RandomMap::kMapBegin[RandomMap::kRigid] = RandomMap::kRigid * RandomMap::kBodyParameters;
    for (int k = 0; k < RandomMap::kBodyParameters; ++k) {
      prior->mean[k] = 1 + 0.3 * normal(random);
      prior->sd[k] = 0.2 + 0.1 * std::abs(normal(random));
    }
    prior->sd[5] = 0;  // one known exactly
    p0 = Matrix::Zero(RandomMap::kBodyParameters, RandomMap::kBodyParameters);
    for (int link = 0; link < 2; ++link) {
      const Matrix j = NumericJacobian(prior->mean + 11 * link);
      const Vector s = Eigen::Map<Vector>(prior->sd + 11 * link, 11);
      p0.block(11 * link, 11 * link, 11, 11) = j * Matrix(s.cwiseAbs2().asDiagonal()) * j.transpose();
    }
    SpreadPrior(*prior);
    FactorPrior(*prior);
  }
  // d (m, mc, Io, rotor) / d (m, c, Ic, rotor) by central differences of the parallel-axis theorem.
  static Matrix NumericJacobian(const double* mean) {
    const auto body = [](const Vector& t) {
      const Eigen::Vector3d c = t.segment<3>(1);
      const Eigen::Matrix3d shift = t(0) * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
      Vector out = t;
      out.segment<3>(1) *= t(0);
      out.segment<6>(4) +=
          (Vector(6) << shift(0, 0), shift(0, 1), shift(0, 2), shift(1, 1), shift(1, 2), shift(2, 2)).finished();
      return out;
    };
    Vector t = Eigen::Map<const Vector>(mean, 11);
    t.segment<3>(1) /= t(0);  // the inertia's value does not enter the derivative
    Matrix j(11, 11);
    for (int k = 0; k < 11; ++k) {
      Vector up = t, down = t;
      up(k) += 1e-5;
      down(k) -= 1e-5;
      j.col(k) = (body(up) - body(down)) / 2e-5;
    }
    return j;
  }
};

TEST_F(RigidPriorTest, Factor_IsTheMappedCovariance) {
  Matrix u = Matrix::Identity(9, 9), d = Matrix::Zero(9, 9);
  for (int j = 0; j < 9; ++j) {
    d(j, j) = prior->ud[math::UdIndex(j, j)];
    for (int i = 0; i < j; ++i) u(i, j) = prior->ud[math::UdIndex(i, j)];
  }
  const Matrix expected = b * p0 * b.transpose();
  EXPECT_LT((u * d * u.transpose() - expected).norm() / expected.norm(), 1e-8);
}

TEST_F(RigidPriorTest, ReadBodies_IsTheStandardParameterKalmanFilter) {
  // 200 torque-like rows z' phi with z in the row space of B, as every regressor is.
  Vector phi0 = Eigen::Map<Vector>(prior->mean, 22);
  Matrix p = p0;
  Vector phi = phi0;
  Matrix base_p = b * p0 * b.transpose();
  Vector base = b * phi0;
  for (int k = 0; k < 200; ++k) {
    const Vector y = Vector::NullaryExpr(9, [&] { return normal(random); });
    const Vector z = b.transpose() * y;
    const double tau = 3 * normal(random);
    const Vector gain = p * z / (z.dot(p * z) + 0.5);
    phi += gain * (tau - z.dot(phi));
    p -= gain * z.transpose() * p;
    const Vector base_gain = base_p * y / (y.dot(base_p * y) + 0.5);
    base += base_gain * (tau - y.dot(base));
    base_p -= base_gain * y.transpose() * base_p;
  }
  Vector got(22);
  ReadBodies(*prior, base.data(), got.data());
  EXPECT_LT((got - phi).norm() / (phi - phi0).norm(), 1e-7);
  EXPECT_LT((b * got - base).norm() / base.norm(), 1e-7);
}

TEST_F(RigidPriorTest, UnchangedBase_ReadsTheMean) {
  Vector base(9), got(22);
  MapBodies<RandomMap>(prior->mean, base.data());
  ReadBodies(*prior, base.data(), got.data());
  EXPECT_LT((got - Eigen::Map<Vector>(prior->mean, 22)).norm(), 1e-12);
}

}  // namespace
}  // namespace armcal::physical
