// tests - the parts of the rigid torque against KDL: each is a difference of torques of the same bodies.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <deque>
#include <random>

#include "codegen/src/generator/arm_torque.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class ArmTorqueOf : public testing::TestWithParam<const char*> {
 protected:
  ArmTorqueOf()
      : robot_(codegen::ReadRobot(std::string("codegen/robots/") + GetParam() + ".toml")),
        model_(robot_, codegen::ReadCatalogue("codegen/effects")),
        arm_(model_),
        bodies_(model_.body_parameters()) {
    for (int p = 0; p < bodies_.size(); ++p) bodies_[p] = model_.table()[p].mean;
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform(-2, 2);
    for (MatrixXd* m : {&s_.q, &s_.qd, &s_.qdd})
      *m = MatrixXd::NullaryExpr(kSamples, n(), [&] { return uniform(random); });
    s_.t = VectorXd::LinSpaced(kSamples, 0, 1);
  }
  int n() const { return robot_.joints(); }
  void Evaluate(const VectorXd& bodies, const std::set<codegen::InputId>& wanted, codegen::TorqueParts& out) const {
    const VectorXd base = model_.base_map() * bodies;
    arm_.Evaluate(s_, {base.data(), static_cast<std::size_t>(base.size())}, wanted, out);
  }
  codegen::TorqueParts Parts(const VectorXd& bodies) const {
    codegen::TorqueParts out;
    Evaluate(bodies, arm_.parts(), out);
    return out;
  }
  // Relative to the largest torque; every part of every sample.
  double Error(const codegen::TorqueParts& parts) const {
    VectorXd still = bodies_;  // what the gears carry: the links without the rotors
    for (int j = 0; j < n(); ++j) still[11 * j + 10] = 0;
    KdlArm arm(robot_, bodies_), links(robot_, still);
    std::deque<KdlArm> tilted;
    for (int axis = 0; axis < 3; ++axis) {
      codegen::Robot one = robot_;
      one.gravity_mps2 = {};
      one.gravity_mps2[axis] = 1;
      tilted.emplace_back(one, bodies_);
    }
    const VectorXd none = VectorXd::Zero(n());
    std::vector<std::vector<VectorXd>> tilt(n(), std::vector<VectorXd>(3, VectorXd(kSamples)));
    double error = 0, scale = 0;
    const auto compare = [&](double part, double oracle) {
      error = std::max(error, std::abs(part - oracle)), scale = std::max(scale, std::abs(oracle));
    };
    for (int k = 0; k < kSamples; ++k) {
      const VectorXd q = s_.q.row(k), qd = s_.qd.row(k), qdd = s_.qdd.row(k);
      const VectorXd rigid = links.Torque(q, qd, qdd), gravity = arm.Torque(q, none, none);
      for (int i = 0; i < n(); ++i) {
        compare(parts.rigid(k, i), rigid[i]), compare(parts.gravity(k, i), gravity[i]);
        for (int j = 0; j < n(); ++j)
          compare(parts.mass[i][j][k], (links.Torque(q, none, VectorXd::Unit(n(), j)) - gravity)[i]);
        for (int axis = 0; axis < 3; ++axis) tilt[i][axis][k] = tilted[axis].Torque(q, none, none)[i];
      }
      for (int j = 0; j < n(); ++j) {
        const VectorXd axis = VectorXd::Unit(n(), j);
        // four places: the error is of fourth order, 1e-13
        const auto slope = [&](const auto& at) -> VectorXd {
          return (8 * (at(kStep_rad) - at(-kStep_rad)) - at(2 * kStep_rad) + at(-2 * kStep_rad)) / (12 * kStep_rad);
        };
        const VectorXd of_gravity =
            slope([&](double step) -> VectorXd { return arm.Torque(q + step * axis, none, none); });
        const VectorXd of_links =
            slope([&](double step) -> VectorXd { return links.Torque(q + step * axis, qd, qdd); });
        // a parabola over the speed: the difference is exact
        const VectorXd over_speed = (links.Torque(q, qd + axis, qdd) - links.Torque(q, qd - axis, qdd)) / 2;
        for (int i = 0; i < n(); ++i) {
          compare(parts.stiffness[i][j][k], of_gravity[i]), compare(parts.slope[i][j][k], of_links[i]);
          compare(parts.speed_slope[i][j][k], over_speed[i]);
        }
      }
    }
    // What turns with joint 1 about an upright axis gravity does not see while the arm is level: no base parameter says
    // how heavy it is, so its part of the tilted torque in row 1, any a cos q1 + b sin q1, is not there.
    MatrixXd turning(kSamples, 2);
    turning << s_.q.col(0).array().cos(), s_.q.col(0).array().sin();
    for (int i = 0; i < n(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        VectorXd off = parts.tilt[i][axis] - tilt[i][axis];
        if (i == 0) off -= turning * turning.colPivHouseholderQr().solve(off);
        compare(off.cwiseAbs().maxCoeff(), 0);
      }
    return error / scale;
  }

  static constexpr int kSamples = 25;
  static constexpr double kStep_rad = 1e-3;
  codegen::Robot robot_;
  codegen::Model model_;
  codegen::ArmTorque arm_;
  VectorXd bodies_;
  codegen::Signals s_;
};

TEST_P(ArmTorqueOf, KdlsBodies_IsKdlsTorquePartByPart) {
  EXPECT_LT(Error(Parts(bodies_)), 1e-11);
  // the judge can see: a tenth of a percent of one link's mass, and two axes of gravity exchanged
  VectorXd heavier = bodies_;
  heavier[11 * (n() - 1)] *= 1.001, heavier[11 * (n() - 1) + 1] *= 1.001;
  EXPECT_GT(Error(Parts(heavier)), 1e-7);
  codegen::TorqueParts exchanged = Parts(bodies_);
  for (auto& row : exchanged.tilt) std::swap(row[0], row[1]);
  EXPECT_GT(Error(exchanged), 1e-4);
}

TEST_P(ArmTorqueOf, SomeParts_AreThoseAloneThatChange) {
  const codegen::TorqueParts before = Parts(bodies_), after = Parts(2 * bodies_);
  codegen::TorqueParts some = before;
  Evaluate(2 * bodies_,
           {{codegen::Quantity::kGravityTorque, 1},
            {codegen::Quantity::kMassMatrix, 1, 0},
            {codegen::Quantity::kGravitySlope, 1, 0, 2},
            {codegen::Quantity::kGravityStiffness, 1, 1},
            {codegen::Quantity::kTorqueSlope, 0, 1},
            {codegen::Quantity::kTorqueSpeedSlope, 1, 0},
            {codegen::Quantity::kModelTorque, 0}},
           some);
  codegen::TorqueParts expected = before;
  expected.gravity.col(1) = after.gravity.col(1);
  expected.mass[1][0] = after.mass[1][0], expected.tilt[1][2] = after.tilt[1][2];
  expected.stiffness[1][1] = after.stiffness[1][1];
  expected.slope[0][1] = after.slope[0][1], expected.speed_slope[1][0] = after.speed_slope[1][0];
  EXPECT_EQ(some.rigid, expected.rigid);
  EXPECT_EQ(some.gravity, expected.gravity);
  EXPECT_EQ(some.mass, expected.mass);
  EXPECT_EQ(some.tilt, expected.tilt);
  EXPECT_EQ(some.stiffness, expected.stiffness);
  EXPECT_EQ(some.slope, expected.slope);
  EXPECT_EQ(some.speed_slope, expected.speed_slope);
  EXPECT_NE(some.mass, before.mass);
}

INSTANTIATE_TEST_SUITE_P(All, ArmTorqueOf, testing::Values("two_link", "er20_like", "ur10"));

}  // namespace
}  // namespace armcal::tests
