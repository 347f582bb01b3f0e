// generator - which body parameters the torque can see, and how the others merge into them; knows no effect.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/rigid_body.hpp"

namespace armcal::codegen {

struct BaseParameters {
  std::vector<int> column;  // chosen body parameters (indices into 11n), ascending
  Eigen::MatrixXd map;      // base = map * body parameters (file's link frames); [chosen x 11n]
};

// Numerically, at absolute scale: columns of the regressor at random states, in long double, taken one by one in a
// fixed order of preference and kept if independent of those before (classic choice ZZ XX XY XZ YZ MX MY per link, then
// rotors, then the rest).
BaseParameters FindBaseParameters(const Graph& graph, const std::vector<std::vector<Expr>>& row, const Robot& robot);

}  // namespace armcal::codegen
