// tests - the host's regressor against KDL, an energy balance and closed forms.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "tests/unit/codegen/checked_in.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {
namespace {

using codegen::Model;
using codegen::Signals;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Signals RandomStates(int samples, int n, unsigned seed, double speed = 2) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  Signals s;
  s.t = VectorXd::LinSpaced(samples, 0, 1);
  const auto fill = [&](MatrixXd& m, double scale) {
    m = MatrixXd::NullaryExpr(samples, n, [&] { return scale * u(random); });
  };
  fill(s.q, 3), fill(s.qd, speed), fill(s.qdd, 5);
  return s;
}

// Random bodies whose inertia about the centre is positive (KDL checks nothing, but zero mass would divide).
VectorXd RandomBodies(int n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  VectorXd b(11 * n);
  for (int k = 0; k < b.size(); ++k) b[k] = u(random);
  for (int j = 0; j < n; ++j) b[11 * j] = 1 + std::abs(b[11 * j]), b[11 * j + 10] = std::abs(b[11 * j + 10]);
  return b;
}

class RobotTest : public testing::TestWithParam<const char*> {};

TEST_P(RobotTest, Regressor_TimesBaseParameters_EqualsKdlForRandomBodiesAndStates) {
  const Model model = Load(GetParam());
  const int n = model.joints(), samples = 2000;
  const Signals s = RandomStates(samples, n, 3);
  const VectorXd bodies = RandomBodies(n, 4);
  const VectorXd base = model.base_map() * bodies;
  std::vector<MatrixXd> row;
  const VectorXd committed = VectorXd::Zero(model.columns());
  model.Regressor(s, {committed.data(), static_cast<std::size_t>(committed.size())}, {}, row);
  KdlArm arm(model.robot(), bodies);
  double error = 0, scale = 0;
  for (int k = 0; k < samples; ++k) {
    const VectorXd tau = arm.Torque(s.q.row(k), s.qd.row(k), s.qdd.row(k));
    for (int i = 0; i < n; ++i) {
      error = std::max(error, std::abs(row[i].row(k).segment(model.front(), model.rigid()).dot(base) - tau[i]));
      scale = std::max(scale, std::abs(tau[i]));
    }
  }
  EXPECT_LT(error, 1e-12 * scale);  // base map is printed with 14 digits; everything else is double round-off
}

TEST_P(RobotTest, StandardColumns_OfEachBody_EqualKdlWithThatBodyAlone) {
  const Model model = Load(GetParam());
  const int n = model.joints(), samples = 50;
  const Signals s = RandomStates(samples, n, 5);
  for (int body = 0; body < n; ++body) {
    VectorXd bodies = VectorXd::Zero(11 * n);
    bodies.segment(11 * body, 10) << 2, 0.3, -0.2, 0.5, 1.1, 0.1, -0.05, 1.3, 0.07, 0.9;
    for (int j = 0; j < n; ++j)
      if (j != body) bodies[11 * j] = 1e-12;
    std::vector<MatrixXd> columns;
    model.BodyColumns(s, body, columns);
    KdlArm arm(model.robot(), bodies);
    for (int k = 0; k < samples; ++k) {
      const VectorXd tau = arm.Torque(s.q.row(k), s.qd.row(k), s.qdd.row(k));
      for (int i = 0; i < n; ++i)
        EXPECT_NEAR(columns[i].row(k).dot(bodies.segment(11 * body, 10)), tau[i], 1e-8)
            << "body " << body + 1 << " row " << i + 1;
    }
  }
}

TEST_P(RobotTest, GravityRegressor_IsTheRegressorAtRest) {
  const Model model = Load(GetParam());
  Signals s = RandomStates(20, model.joints(), 6);
  std::vector<MatrixXd> gravity, row;
  model.GravityRegressor(s, gravity);
  s.qd.setZero(), s.qdd.setZero();
  model.Regressor(s, {}, {}, row);
  for (int i = 0; i < model.joints(); ++i)
    EXPECT_LT((gravity[i] - row[i].middleCols(model.front(), model.rigid())).cwiseAbs().maxCoeff(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotTest,
                         testing::Values("er20_like", "puma560", "ur10", "kuka_kr300", "emps", "two_link"));

TEST(BaseParameters, Er20Like_Has36InertialAnd4RotorParameters) {
  const Model model = Load("er20_like");
  EXPECT_EQ(model.rigid(), 40);
  int rotors = 0;
  for (int c = model.front(); c < model.front() + model.rigid(); ++c)
    rotors += model.column_name(c).rfind("Ia", 0) == 0;
  EXPECT_EQ(rotors, 4);  // Ia1 is the same column as Izz1, Ia2 nearly
}

// The third oracle: tau . qd is the rate of change of kinetic plus potential energy. Energy is taken from KDL-free
// means: the regressor's own mass matrix is NOT used; energy differences follow from integrating power along a smooth
// path and must close on a cycle.
TEST(Energy, PowerOverAClosedPath_SumsToZero) {
  const Model model = Load("er20_like");
  const int samples = 20000;
  Signals s = RandomStates(samples, 6, 1);
  const double w = 2 * M_PI;
  for (int k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / samples;  // one period, t in [0, 1)
    s.t[k] = t;
    for (int j = 0; j < 6; ++j) {
      const double a = 0.5 + 0.1 * j, phase = 0.7 * j, h = 1 + j % 3;
      s.q(k, j) = a * std::sin(h * w * t + phase);
      s.qd(k, j) = a * h * w * std::cos(h * w * t + phase);
      s.qdd(k, j) = -a * h * w * h * w * std::sin(h * w * t + phase);
    }
  }
  std::vector<MatrixXd> row;
  model.Regressor(s, {}, {}, row);
  const VectorXd base = model.base_map() * RandomBodies(6, 8);
  double net = 0, gross = 0;
  for (int i = 0; i < 6; ++i) {
    const VectorXd power = (row[i].middleCols(model.front(), model.rigid()) * base).cwiseProduct(s.qd.col(i));
    net += power.sum() / samples;
    gross += power.cwiseAbs().sum() / samples;
  }
  EXPECT_LT(std::abs(net), 1e-10 * gross);  // trapezoid over a full period converges faster than any power of the step
}

// Planar two-link arm in a vertical plane, textbook closed form (links as point masses with inertia about the joint).
TEST(TwoLink, Torque_EqualsClosedForm) {
  const Model model = Load("two_link");
  const double l = model.robot().joint[1].kinematics.a_m, g = 9.81;
  const double m1 = 3, c1 = 0.2, I1 = 0.3, m2 = 2, c2 = 0.25, I2 = 0.2;  // I about the joint axes
  VectorXd bodies = VectorXd::Zero(22);
  bodies[0] = m1, bodies[1] = m1 * c1, bodies[9] = I1;
  bodies[11] = m2, bodies[12] = m2 * c2, bodies[20] = I2;
  const Signals s = RandomStates(100, 2, 9);
  std::vector<MatrixXd> row;
  model.Regressor(s, {}, {}, row);
  const VectorXd base = model.base_map() * bodies;
  for (int k = 0; k < 100; ++k) {
    const double q1 = s.q(k, 0), q2 = s.q(k, 1), v1 = s.qd(k, 0), v2 = s.qd(k, 1), a1 = s.qdd(k, 0), a2 = s.qdd(k, 1);
    const double h = m2 * l * c2;
    const double tau2 =
        I2 * (a1 + a2) + h * std::cos(q2) * a1 + h * std::sin(q2) * v1 * v1 + m2 * c2 * g * std::cos(q1 + q2);
    const double tau1 = (I1 + m2 * l * l) * a1 + h * std::cos(q2) * (2 * a1 + a2) -
                        h * std::sin(q2) * (2 * v1 * v2 + v2 * v2) + I2 * (a1 + a2) +
                        (m1 * c1 + m2 * l) * g * std::cos(q1) + m2 * c2 * g * std::cos(q1 + q2);
    EXPECT_NEAR(row[0].row(k).segment(model.front(), model.rigid()).dot(base), tau1, 1e-10);
    EXPECT_NEAR(row[1].row(k).segment(model.front(), model.rigid()).dot(base), tau2, 1e-10);
  }
}

}  // namespace
}  // namespace armcal::tests
