// tests - what base parameters say of the rotors, against bodies drawn from the robot file's prior.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codegen/src/generator/model.hpp"

namespace armcal::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDraws = 20000, kBlock = 11;

// [m, m c, I about the link's origin, Ia] of a body drawn around the robot file's numbers; step: of their deviations.
VectorXd Drawn(const codegen::Robot& robot, const codegen::Joint& joint, double rotor, double rotor_sd, double step,
               std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const codegen::Link& l = joint.link;
  const double floor = robot.inertia_floor_ratio * std::max({l.inertia_kgm2[0], l.inertia_kgm2[3], l.inertia_kgm2[5]});
  const auto around = [&](double value, double least) {
    return value + step * std::max(robot.link_relative_sd * std::abs(value), least) * normal(random);
  };
  const double m = around(l.mass_kg, 0);
  Eigen::Vector3d c;
  for (int k = 0; k < 3; ++k) c[k] = around(l.center_m[k], robot.center_floor_m);
  Eigen::Matrix3d I;
  int at = 0;
  for (int row = 0; row < 3; ++row)
    for (int col = row; col < 3; ++col) I(row, col) = I(col, row) = around(l.inertia_kgm2[at++], floor);
  I += m * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  VectorXd body(kBlock);
  body << m, m * c, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2), rotor + step * rotor_sd * normal(random);
  return body;
}

class RotorsOf : public testing::TestWithParam<const char*> {
 protected:
  RotorsOf() : robot_(codegen::ReadRobot(std::string("codegen/robots/") + GetParam() + ".toml")) {}
  codegen::Model Made() const { return codegen::Model(robot_, codegen::ReadCatalogue("codegen/effects")); }
  codegen::Robot robot_;
};

// The best guess from the base parameters leaves an error whose mean is zero and which no base parameter explains. A
// small step keeps the draws where the way to the link origins is straight; the best guess does not depend on it.
void ExpectBestGuess(const codegen::Model& model, double sharpest) {
  const codegen::Robot& robot = model.robot();
  std::mt19937_64 random(5);
  MatrixXd base(kDraws, model.rigid()), rotor(kDraws, robot.joints());
  constexpr double kStep = 1e-4;
  VectorXd bodies(kBlock * robot.joints());
  for (int k = 0; k < kDraws; ++k) {
    for (int j = 0; j < robot.joints(); ++j) {
      const auto& stated = model.table()[static_cast<std::size_t>(kBlock * j + 10)];
      bodies.segment(kBlock * j, kBlock) =
          Drawn(robot, robot.joint[static_cast<std::size_t>(j)], stated.mean, stated.sd, kStep, random);
      rotor(k, j) = bodies[kBlock * j + 10];
    }
    base.row(k) = model.base_map() * bodies;
  }
  const MatrixXd moved = base.rowwise() - base.colwise().mean();
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::RotorInertia& guess = model.rotors()[static_cast<std::size_t>(j)];
    const double sd = kStep * model.table()[static_cast<std::size_t>(kBlock * j + 10)].sd;
    const VectorXd error = (rotor.col(j) - base * guess.share).array() - guess.rest;
    EXPECT_LT(std::abs(error.mean()), 5 * sd / std::sqrt(kDraws)) << "joint " << j + 1;
    for (int d = 0; d < model.rigid(); ++d) {
      const double together = error.dot(moved.col(d)) / moved.col(d).norm() / std::sqrt(kDraws);
      EXPECT_LT(std::abs(together), (5 / std::sqrt(kDraws) + 2e-3) * sd) << "joint " << j + 1 << ", base " << d;
    }
    EXPECT_LT(error.norm() / std::sqrt(kDraws), sharpest * sd) << "joint " << j + 1;
  }
}

TEST_P(RotorsOf, StatedRotors_AreTheBestGuess) { ExpectBestGuess(Made(), 1.01); }

// A rotor that nobody stated is far less known than its link, so the base parameters tell nearly all of it.
TEST_P(RotorsOf, UnstatedRotors_AreTheBestGuessAndAreFound) {
  for (codegen::Joint& joint : robot_.joint) joint.wide.insert("Ia");
  ExpectBestGuess(Made(), 0.3);
}

TEST_P(RotorsOf, NoPrior_IsWhatTheFileStates) {
  robot_.has_prior = false;
  const codegen::Model model = Made();
  for (int j = 0; j < robot_.joints(); ++j) {
    const codegen::Motor& motor = robot_.joint[static_cast<std::size_t>(j)].motor;
    EXPECT_EQ(model.rotors()[static_cast<std::size_t>(j)].rest,
              motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kgm2);
    EXPECT_TRUE(model.rotors()[static_cast<std::size_t>(j)].share.isZero());
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, RotorsOf, testing::Values("two_link", "er20_like"));

}  // namespace
}  // namespace armcal::tests
