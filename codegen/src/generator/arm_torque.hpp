// generator - rigid torque, gravity's part, mass matrix and the torque of tilted gravity over whole logs; knows no
// effect.
#pragma once

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// N samples, n joints.
struct TorqueParts {
  Eigen::MatrixXd rigid, gravity;                  // [N x n]
  std::vector<std::vector<Eigen::VectorXd>> mass;  // [row][joint] entry of M of (1)
  std::vector<std::vector<Eigen::VectorXd>> tilt;  // [row][axis] per m/s^2 of gravity along the base frame's x, y, z
};

// One graph for all of them; immutable after construction.
class ArmTorque {
 public:
  explicit ArmTorque(const Model& model);

  // base: values of the model's base parameters.
  TorqueParts Evaluate(const Signals& s, std::span<const double> base) const;

 private:
  int joints_;
  Graph graph_;
  std::unique_ptr<Tape> tape_;
};

}  // namespace armcal::codegen
