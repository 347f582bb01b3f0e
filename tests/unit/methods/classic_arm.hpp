// tests - arms as in the survey, without rotors, torque gains and undeclared effects, and problems for them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/identify/methods/method.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {

enum class Columns { kBase, kStandard };

inline codegen::Robot PlainRobot(const std::string& name, Columns columns) {
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/" + name + ".toml");
  robot.effect.clear();
  robot.parameters.standard = columns == Columns::kStandard;
  for (int j = 0; j < robot.joints(); ++j) {
    robot.joint[j].motor.torque_constant_tolerance = 0;
    robot.joint[j].motor.rotor_inertia_kgm2 = 0;
    robot.parameters.omit.push_back(11 * j + 10);
  }
  return robot;
}

inline codegen::Robot WithStribeck(codegen::Robot robot) {
  codegen::EffectUse use;
  use.effect = "stribeck";
  for (int j = 0; j < robot.joints(); ++j) use.joints.push_back(j);
  robot.effect.push_back(use);
  return robot;
}

// delta_s = 2 as in (4), not to be found.
inline void HoldDelta(calibration::Problem& problem) {
  const codegen::Model& model = *problem.model;
  for (int k = 0; k < model.nonlinear(); ++k) {
    const int c = model.columns() + k;
    if (model.unknowns()[k].key == "delta") problem.start[c] = problem.lower[c] = problem.upper[c] = 2;
  }
}

// (4) besides what the synthetic arm has: a fifth of Fc more at standstill, gone above 0.1 rad/s.
inline Effect Stribeck(const SyntheticArm& arm) {
  return [&arm](const State& s) {
    return 0.2 * arm.Friction("Fc", s.joint) * std::copysign(std::exp(-100 * s.qd * s.qd), s.qd);
  };
}

// K of all columns and tau, row by row in order of time: what a textbook would write down.
struct Stacked {
  Eigen::MatrixXd K;
  Eigen::VectorXd tau;
  std::vector<int> joint, sample;
};
inline Stacked StackByHand(const codegen::Model& model, const calibration::Dataset& d) {
  std::vector<Eigen::MatrixXd> row;
  model.Regressor(d.s, std::vector<double>(model.columns(), 0.0), {}, row);
  Stacked out;
  out.K.resize(d.used.sum(), model.columns());
  out.tau.resize(out.K.rows());
  for (int k = 0; k < d.samples(); ++k)
    for (int j = 0; j < model.joints(); ++j) {
      if (!d.used(k, j)) continue;
      const auto r = static_cast<Eigen::Index>(out.joint.size());
      out.K.row(r) = row[j].row(k);
      out.tau[r] = d.tau(k, j);
      out.joint.push_back(j), out.sample.push_back(k);
    }
  return out;
}

// What a step x - expected makes of the torque, relative to the torque.
inline double TorqueShare(const Stacked& s, const Eigen::VectorXd& x, const Eigen::VectorXd& expected) {
  return (s.K * (x - expected)).norm() / s.tau.norm();
}

}  // namespace armcal::tests
