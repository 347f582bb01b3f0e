// generator - finds which body parameters the torque shows, and how the other ones merge into them.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/rigid_body.hpp"

namespace armcal::codegen {

struct BaseParameters {
  std::vector<int> column;  // chosen body parameters (indices into 11n), ascending
  Eigen::MatrixXd map;      // base = map * body parameters (file's link frames); [chosen x 11n]
};

// Numerically, at absolute scale: columns of the regressor at random states, in long double, taken one by one and kept
// if independent of those before: first what the robot file prefers, then the classic choice (ZZ XX XY XZ YZ MX MY per
// link, then rotors, then the rest). Omitted columns are taken as zero. With [parameters] set = "standard": every
// column that is not zero, dependent or not; its map has a single one a row. row: [joint][11n] about the slid frames of
// BestFrames(robot). extra: rows stacked under them for the decision only.
BaseParameters FindBaseParameters(const Graph& graph, const BodyRows& row, const Robot& robot,
                                  const BodyRows& extra = {});

// The chosen columns alone, ascending; row may be about any frames.
std::vector<int> IndependentColumns(const Graph& graph, const BodyRows& row, const Robot& robot,
                                    const BodyRows& extra = {});

// The way back is not unique: the body parameters that give this base and are nearest to `reference` (sum of squares).
Eigen::VectorXd BodiesFromBase(const BaseParameters& base, const Eigen::VectorXd& value,
                               const Eigen::VectorXd& reference);

}  // namespace armcal::codegen
