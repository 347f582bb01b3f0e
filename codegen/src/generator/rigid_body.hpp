// generator - the rigid arm's torque, linear in the body parameters, as a graph; knows no effect and no output format.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/graph.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

inline constexpr int kBodyBlock =
    11;  // m, m c (3), I about the frame origin (xx xy xz yy yz zz), rotor inertia (joint side)

// Names "q1", "qd1", "qdd1" ... of the graph inputs of joint i (0-based).
std::string InputName(const char* quantity, int joint);

// Torque of joint i per unit of parameter p of link j: row[i][kBodyBlock j + p]; zero expressions where it has none.
// Link frames are slid along their joint axis where that saves work (the last revolute one goes to d = 0); the returned
// parameters are about the slid origins. With motion = false speeds and accelerations are zero (gravity only).
std::vector<std::vector<Expr>> BodyRegressor(Graph& graph, const Robot& robot, bool motion = true);

// slid parameters = S parameters about the file's link frames; 11n x 11n.
Eigen::MatrixXd SlideMap(const Robot& robot);

}  // namespace armcal::codegen
