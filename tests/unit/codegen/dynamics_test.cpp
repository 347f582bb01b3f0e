// tests - generated M, V and G of (1) against KDL, and the addresses that registers.hpp names against SPEC's.
#include <gtest/gtest.h>

#include <random>

#include "codegen/generated/emps/dynamics.hpp"
#include "codegen/generated/emps/model.hpp"
#include "codegen/generated/er20_like/dynamics.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/generated/er20_like/registers.hpp"
#include "codegen/generated/two_link/dynamics.hpp"
#include "codegen/generated/two_link/model.hpp"
#include "codegen/src/generator/model.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {
namespace {

using Eigen::VectorXd;

// Physical by construction, so that KDL can be given centres: masses 1..2, centres within 0.3 m, inertia of a ball.
VectorXd RandomBodies(int joints, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-0.3, 0.3);
  VectorXd b = VectorXd::Zero(11 * joints);
  for (int j = 0; j < joints; ++j) {
    const double m = 1.5 + u(random), x = u(random), y = u(random), z = u(random), ball = 0.2;
    b.segment(11 * j, 11) << m, m * x, m * y, m * z, ball + m * (y * y + z * z), -m * x * y, -m * x * z,
        ball + m * (x * x + z * z), -m * y * z, ball + m * (x * x + y * y), 0.5 + u(random);
  }
  return b;
}

template <class Generated, class Dynamics>
void CompareWithKdl(const std::string& name) {
  constexpr int n = Generated::kJoints;
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/" + name + ".toml");
  const codegen::Model model(robot, codegen::ReadCatalogue("codegen/effects"));
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-2, 2);
  for (int trial = 0; trial < 100; ++trial) {
    const VectorXd bodies = RandomBodies(n, random), base = model.base_map() * bodies;
    KdlArm kdl(robot, bodies);
    const VectorXd q = VectorXd::NullaryExpr(n, [&] { return u(random); });
    const VectorXd qd = VectorXd::NullaryExpr(n, [&] { return u(random); }), rest = VectorXd::Zero(n);
    model::ModelInput<double, n> x{};
    for (int j = 0; j < n; ++j) x.q[j] = q[j], x.qd[j] = qd[j];
    double M[n * n], V[n], G[n];
    Dynamics::MassMatrix(x, base.data(), M);
    Dynamics::VelocityTorque(x, base.data(), V);
    Dynamics::GravityTorque(x, base.data(), G);
    // Torques reach a few hundred N m; both sides are sums of some hundred products in double.
    const VectorXd gravity = kdl.Torque(q, rest, rest), velocity = kdl.Torque(q, qd, rest) - gravity;
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(G[i], gravity[i], 1e-11) << name;
      EXPECT_NEAR(V[i], velocity[i], 1e-11) << name;
      const VectorXd column = kdl.Torque(q, rest, VectorXd::Unit(n, i)) - gravity;
      for (int j = 0; j < n; ++j) EXPECT_NEAR(M[j * n + i], column[j], 1e-11) << name << " " << j << " " << i;
    }
  }
}

TEST(Dynamics, MassVelocityAndGravity_EqualKdl) {
  CompareWithKdl<generated::Er20Like, generated::Er20LikeDynamics>("er20_like");
  CompareWithKdl<generated::TwoLink, generated::TwoLinkDynamics>("two_link");
  CompareWithKdl<generated::Emps, generated::EmpsDynamics>("emps");
}

// SPEC.md: estimates of filter A from 0x0100, deviations from 0x0300, filter B 0x0500 and 0x0700, two registers each.
TEST(Registers, NamedAddresses_AreThoseOfTheSpecification) {
  int column = 0;
  for (const auto& r : generated::kEr20LikeRegisters) {
    EXPECT_EQ(r.estimate_a, 0x0100 + 2 * column);
    EXPECT_EQ(r.deviation_a, 0x0300 + 2 * column);
    EXPECT_EQ(r.estimate_b, 0x0500 + 2 * column);
    EXPECT_EQ(r.deviation_b, 0x0700 + 2 * column);
    ++column;
  }
  EXPECT_EQ(column, generated::Er20Like::kColumns);
  EXPECT_STREQ(generated::kEr20LikeRegisters[1].name, "Fv1");
  EXPECT_STREQ(generated::kEr20LikeRegisters[1].unit, "N*m*s/rad");
}

}  // namespace
}  // namespace armcal::tests
