// methods - the regression behind the exogeneity test, of one joint; knows no log and no verdict.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host_sim/identify/methods/exogeneity.hpp"

namespace armcal::calibration {

// Rows that follow each other.
struct Piece {
  Eigen::Index first, count;
};

// One joint's rows over all logs: regressors [N x k], instruments [N x k], torque [N], and the pieces without a gap.
struct JointRows {
  Eigen::MatrixXd X, Z;
  Eigen::VectorXd tau;
  std::vector<Piece> pieces;
};

// tau = X x + V g + e with V what Z leaves of X, whitened: F and p of g = 0, and by what x differs without V.
// `exogenous` is not judged.
JointExogeneity AugmentedRegression(const JointRows& rows);

}  // namespace armcal::calibration
