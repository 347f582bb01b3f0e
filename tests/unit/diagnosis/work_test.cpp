// diagnosis tests - what a diagnosis starts from: its candidates, and the column of a torque gain as KDL has it.
#include "host_sim/diagnose/diagnosis/work.hpp"

#include <gtest/gtest.h>

#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using Eigen::VectorXd;

// The effect is in the model of joint 1. A diagnosis may find it there too, unless the model already estimates it.
TEST(Candidates, AnEffectOfTheRobotThatIsNotEstimated_IsOneOfThem) {
  const std::string effect = "viscous_cubic";
  const codegen::Catalogue records = {{effect, tests::Records().at(effect)}};
  for (const char* state : {"estimated", "standby"}) {
    codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
    codegen::EffectUse use;
    use.effect = effect, use.joints = {0}, use.state = state;
    robot.effect.push_back(use);
    const codegen::Model model(robot, tests::Records());
    std::vector<std::vector<int>> joints;
    for (const auto& c : MakeCandidates(records, model)) joints.push_back(c->joints());
    const std::vector<std::vector<int>> both = {{0}, {1}}, other = {{1}};
    EXPECT_EQ(joints, state == std::string("standby") ? both : other) << state;
  }
}

// Per unit of gain a joint's torque grows by the model's torque: KDL's for the bodies of the estimate, and friction.
TEST(GainColumn, IsTheModelsTorqueAtTheEstimate) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  for (codegen::Joint& joint : robot.joint) joint.motor.torque_constant_tolerance = 0.1;
  tests::SyntheticArm arm(robot, 6);
  const calibration::Dataset log = arm.Run(4, 62);
  const codegen::Catalogue records;
  Diagnosis::Work work(arm.model(), records, {&log});
  work.estimate.x = arm.truth();
  work.Prepare({});
  tests::KdlArm kdl(robot, arm.bodies());
  for (int j = 0; j < arm.model().joints(); ++j) {
    const auto& own = work.rows.columns[static_cast<std::size_t>(j)];
    ASSERT_EQ(work.declared.active[static_cast<std::size_t>(own.back())], arm.model().columns() + j);
    std::vector<double> expected;
    for (int k = 0; k < log.samples(); ++k) {
      if (!log.used(k, j)) continue;
      const double qd = log.s.qd(k, j), rigid = kdl.Torque(log.s.q.row(k), log.s.qd.row(k), log.s.qdd.row(k))[j];
      expected.push_back(rigid + arm.Friction("Fc", j) * (qd > 0 ? 1 : -1) + arm.Friction("Fv", j) * qd);
    }
    const auto column = work.rows.design[static_cast<std::size_t>(j)].rightCols(1);
    ASSERT_EQ(column.rows(), static_cast<Eigen::Index>(expected.size()));
    const VectorXd by_kdl = VectorXd::Map(expected.data(), column.rows());
    EXPECT_LT((column - by_kdl).cwiseAbs().maxCoeff(), 1e-9 * by_kdl.cwiseAbs().maxCoeff()) << "joint " << j + 1;
  }
}

}  // namespace
}  // namespace armcal::diagnosis
