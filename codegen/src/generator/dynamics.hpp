// generator - M, V and G of (1) as expressions.
#pragma once

#include <vector>

#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/generator/robot_prior.hpp"

namespace armcal::codegen {

// The base parameters are the graph inputs "base0", "base1" ... in the order of base_columns (indices into 11n).
struct Dynamics {
  std::vector<std::vector<Expr>> mass;  // [column j][i <= j]: upper triangle of M, by column
  std::vector<Expr> velocity, gravity;  // V and G, one a joint
};
Dynamics MakeDynamics(Graph& graph, const Robot& robot, const std::vector<int>& base_columns);

// Torque of joint i: its row times the base parameters.
Expr BaseTorque(Graph& graph, const BodyRows& rows, const std::vector<int>& base_columns, int i);

// The same without the rotors: what the gears carry.
Expr LoadTorque(Graph& graph, const BodyRows& rows, const std::vector<int>& base_columns,
                const std::vector<RotorInertia>& rotors, int i);

// Body rows of an arm without weight that stands still and accelerates by one at a joint: times parameters, a column of
// M.
BodyRows AccelerationRows(Graph& graph, const Robot& robot, int joint);

// The last link's frame seen from the base.
struct Flange {
  std::array<Expr, 3> position, approach;  // m; direction of its z axis
};
Flange FlangeOf(Graph& graph, const Robot& robot);

}  // namespace armcal::codegen
