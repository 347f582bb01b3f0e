// methods tests - friction and effects at one instant, against KDL and formulas.
#include "host_sim/identify/methods/effect_point.hpp"

#include <gtest/gtest.h>

#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::VectorXd;

// Friction that grows with the load reads the torque of the bodies, so it reads their base parameters. These do not
// stand at the front of the coordinates: friction does.
TEST(EffectPoint, FrictionThatGrowsWithTheLoad_ReadsTheBodiesAsKdlHasThem) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  codegen::EffectUse use;
  use.effect = "load_friction", use.joints = {0, 1};
  robot.effect.push_back(use);
  const tests::SyntheticArm arm(robot, 4);
  const codegen::Model& model = arm.model();
  VectorXd z = arm.truth().head(model.columns());
  const double mu[] = {0.05, 0.12};
  for (int c = 0; c < model.columns(); ++c)
    if (!model.is_rigid(c) && model.table()[model.table_index(c)].effect == "load_friction")
      z[c] = mu[model.column_joint(c)];
  tests::KdlArm kdl(robot, arm.bodies());
  EffectPoint point(model);
  const struct {
    VectorXd q, qd, qdd;
  } instants[] = {{Eigen::Vector2d(0.3, -1.1), Eigen::Vector2d(0.8, -1.2), Eigen::Vector2d(2, 5)},
                  {Eigen::Vector2d(-2, 0.4), Eigen::Vector2d(-0.1, -2), Eigen::Vector2d(-7, 1)}};
  for (const auto& at : instants) {
    point.Set(0, at.q, at.qd, at.qdd, {}, z);
    const VectorXd torque = point.Torque(), rigid = kdl.Torque(at.q, at.qd, at.qdd);
    for (int j = 0; j < 2; ++j) {
      // The rotor is no load of the gear. robot_prior_test.cpp judges what base parameters say of it.
      const codegen::RotorInertia& inertia = model.rotors()[static_cast<std::size_t>(j)];
      const double rotor = (inertia.rest + inertia.share.dot(model.base_map() * arm.bodies())) * at.qdd[j];
      const double sign = at.qd[j] > 0 ? 1 : -1, load = mu[j] * std::abs(rigid[j] - rotor) * sign;
      ASSERT_GT(std::abs(load), 0.01);
      EXPECT_NEAR(torque[j], arm.Friction("Fc", j) * sign + arm.Friction("Fv", j) * at.qd[j] + load, 1e-9)
          << "joint " << j + 1;
    }
  }
}

}  // namespace
}  // namespace armcal::calibration
