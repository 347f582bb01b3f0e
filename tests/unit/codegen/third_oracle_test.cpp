// tests - rigid dynamics without KDL: Lagrange's equations by differences, and the PUMA 560's published numbers.
#include <gtest/gtest.h>

#include "codegen/src/robot/frames.hpp"
#include "tests/unit/codegen/rigid_oracle.hpp"

namespace armcal::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Energies of an arm from positions and Jacobians of its bodies; no recursion of velocities or accelerations.
class Energies {
 public:
  Energies(const codegen::Robot& robot, const std::vector<Body>& bodies) : robot_(robot), bodies_(bodies) {}

  MatrixXd Mass(const VectorXd& q) const {
    const int n = robot_.joints();
    MatrixXd M = MatrixXd::Zero(n, n);
    Walk(q, [&](int j, const Vector3d& c, const Matrix3d& R, const MatrixXd& linear, const MatrixXd& angular) {
      (void)c;
      const double* I = bodies_[j].I;
      Matrix3d inertia;
      inertia << I[0], I[1], I[2], I[1], I[3], I[4], I[2], I[4], I[5];
      M += bodies_[j].m * linear.transpose() * linear + angular.transpose() * R * inertia * R.transpose() * angular;
      M(j, j) += bodies_[j].rotor;
    });
    return M;
  }
  double Potential(const VectorXd& q) const {
    double energy = 0;
    const Vector3d g(robot_.gravity_mps2.data());
    Walk(q, [&](int j, const Vector3d& c, const Matrix3d&, const MatrixXd&, const MatrixXd&) {
      energy -= bodies_[j].m * g.dot(c);
    });
    return energy;
  }
  // tau = M qdd + dM/dt qd - d(qd' M qd / 2)/dq + dU/dq; derivatives by central differences of fourth order.
  VectorXd Torque(const State& s) const {
    const int n = robot_.joints();
    const double h = 2e-3;  // error of the differences h^4 = 2e-11, of their round-off 1e-16 / h = 5e-14
    VectorXd tau = Mass(s.q) * s.qdd;
    MatrixXd rate = MatrixXd::Zero(n, n);
    for (int k = 0; k < n; ++k) {
      const VectorXd step = h * VectorXd::Unit(n, k);
      const auto difference = [&](auto f) -> decltype(f(s.q)) {
        return (8 * (f(s.q + step) - f(s.q - step)) - (f(s.q + 2 * step) - f(s.q - 2 * step))) / (12 * h);
      };
      const MatrixXd dM = difference([&](const VectorXd& q) -> MatrixXd { return Mass(q); });
      rate += dM * s.qd[k];
      tau[k] -= 0.5 * s.qd.dot(dM * s.qd);
      tau[k] += difference([&](const VectorXd& q) { return Potential(q); });
    }
    return tau + rate * s.qd;
  }

 private:
  template <class F>
  void Walk(const VectorXd& q, F visit) const {
    const int n = robot_.joints();
    std::vector<Eigen::Isometry3d> frame;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int k = 0; k < 9; ++k) T.linear()(k / 3, k % 3) = robot_.base_rotation[k];
    for (int j = 0; j < n; ++j) {
      const auto& d = robot_.joint[j].kinematics;
      const bool revolute = d.type == codegen::JointType::kRevolute;
      const double theta = d.theta_rad + (revolute ? q[j] : 0), shift = d.d_m + (revolute ? 0 : q[j]);
      T = T * Eigen::AngleAxisd(d.alpha_rad, Vector3d::UnitX()) * Eigen::Translation3d(d.a_m, 0, 0) *
          Eigen::AngleAxisd(theta, Vector3d::UnitZ()) * Eigen::Translation3d(0, 0, shift);
      frame.push_back(T);
      const Vector3d c = T * Vector3d(bodies_[j].c);
      MatrixXd linear = MatrixXd::Zero(3, n), angular = linear;
      for (int i = 0; i <= j; ++i) {
        const Vector3d z = frame[i].linear().col(2);
        if (robot_.joint[i].kinematics.type == codegen::JointType::kRevolute) {
          angular.col(i) = z;
          linear.col(i) = z.cross(c - frame[i].translation());
        } else {
          linear.col(i) = z;
        }
      }
      visit(j, c, Matrix3d(T.linear()), linear, angular);
    }
  }

  const codegen::Robot& robot_;
  const std::vector<Body>& bodies_;
};

double ErrorAgainstLagrange(const codegen::Robot& robot, int states, unsigned seed) {
  const GraphArm arm(robot);
  std::mt19937_64 random(seed);
  double error = 0, scale = 0;
  for (int k = 0; k < states; ++k) {
    const auto bodies = RandomBodies(robot.joints(), random);
    const State s = RandomState(robot.joints(), random);
    const VectorXd expected = Energies(robot, bodies).Torque(s);
    error = std::max(error, (arm.Torque()(s, bodies) - expected).cwiseAbs().maxCoeff());
    scale = std::max(scale, expected.cwiseAbs().maxCoeff());
  }
  return error / scale;
}

constexpr double kDifferences = 1e-8;  // of Energies::Torque, times the fifth derivative's size

TEST(Lagrange, OfA3R_EqualsTheRegressor) {
  std::mt19937_64 random(21);
  for (int trial = 0; trial < 5; ++trial) {
    codegen::Robot robot = RandomArm(3, random);
    for (auto& j : robot.joint) j.kinematics.type = codegen::JointType::kRevolute;
    EXPECT_LT(ErrorAgainstLagrange(robot, 40, 22), kDifferences);
  }
}

TEST(Lagrange, OfMixedChains_EqualsTheRegressor) {
  std::mt19937_64 random(23);
  for (int n = 1; n <= 5; ++n) EXPECT_LT(ErrorAgainstLagrange(RandomArm(n, random), 20, 24), kDifferences) << n;
}

TEST(Lagrange, OfThePuma_EqualsTheRegressor) {
  EXPECT_LT(ErrorAgainstLagrange(codegen::ReadRobot("codegen/robots/puma560.toml"), 20, 25), kDifferences);
}

// P. Corke, Robotics, Vision and Control: gravity load and inertia matrix of the PUMA 560 (Armstrong's link data) in
// the "nominal" pose (0, 45, 180, 0, 45, 0) deg, printed with four decimals.
class PumaNominal : public testing::Test {
 protected:
  PumaNominal()
      : robot_(codegen::ReadRobot("codegen/robots/puma560.toml")),
        arm_(robot_),
        bodies_(BodiesOf(robot_)),
        state_{VectorXd::Zero(6), VectorXd::Zero(6), VectorXd::Zero(6)} {
    state_.q << 0, M_PI / 4, M_PI, 0, M_PI / 4, 0;
  }
  codegen::Robot robot_;
  GraphArm arm_;
  std::vector<Body> bodies_;
  State state_;
};

TEST_F(PumaNominal, GravityLoad_IsThePublishedOne) {
  const double published[] = {0, 31.6399, 6.0351, 0, 0.0283, 0};
  const VectorXd tau = arm_.Torque()(state_, bodies_);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(tau[i], published[i], 0.51e-4) << "joint " << i + 1;
}

TEST_F(PumaNominal, InertiaMatrix_IsThePublishedOne) {
  const double published[6][6] = {{3.6594, -0.4044, 0.1006, -0.0025, 0, 0}, {-0.4044, 4.4137, 0.3509, 0, 0.0024, 0},
                                  {0.1006, 0.3509, 0.9378, 0, 0.0015, 0},   {-0.0025, 0, 0, 0.1925, 0, 0},
                                  {0, 0.0024, 0.0015, 0, 0.1713, 0},        {0, 0, 0, 0, 0, 0.1941}};
  const VectorXd rest = arm_.Torque()(state_, bodies_);
  for (int k = 0; k < 6; ++k) {
    State s = state_;
    s.qdd[k] = 1;
    const VectorXd column = arm_.Torque()(s, bodies_) - rest;
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(column[i], published[i][k], 0.51e-4) << i + 1 << "," << k + 1;
  }
}

}  // namespace
}  // namespace armcal::tests
