// generator - the rigid torque, its gravity part, the mass matrix and the slopes over gravity and position, over whole
// logs.
#pragma once

#include <set>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// N samples, n joints.
struct TorqueParts {
  Eigen::MatrixXd rigid, gravity;                  // [N x n]
  std::vector<std::vector<Eigen::VectorXd>> mass;  // [row][joint] entry of M of (1)
  std::vector<std::vector<Eigen::VectorXd>> tilt;  // [row][axis] per m/s^2 of gravity along the base frame's x, y, z
  std::vector<std::vector<Eigen::VectorXd>>
      stiffness;  // [row][joint] gravity's torque per unit of the joint's position
  std::vector<std::vector<Eigen::VectorXd>> slope,
      speed_slope;  // [row][joint] the links' torque per unit of the joint's position and speed
  // Where the last link's frame stands, m, and the direction of its z axis, and their slopes over the row's position.
  std::vector<Eigen::VectorXd> flange, approach;                       // [axis]
  std::vector<std::vector<Eigen::VectorXd>> jacobian, approach_slope;  // [row][axis]
};

// One graph for all of them; immutable after construction.
class ArmTorque {
 public:
  explicit ArmTorque(const Model& model);

  // base: values of the model's base parameters. wanted: the parts to compute, by the inputs that stand for them;
  // other parts are left as they are, and inputs that are no part mean nothing here.
  void Evaluate(const Signals& s, std::span<const double> base, const std::set<InputId>& wanted,
                TorqueParts& out) const;
  std::set<InputId> parts() const;  // all of them

 private:
  struct Part {
    InputId id;
    Expr value;
  };
  int joints_;
  Graph graph_;
  std::vector<Part> part_;  // in the order of TorqueParts
};

}  // namespace armcal::codegen
