// calibration - least squares over whole logs in memory that does not grow with them; knows no prior.
#pragma once

#include <span>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/calibration/gram_solve.hpp"

namespace armcal::calibration {

// Minimises sum_j weight[j] |tau_j - Y_j x|^2 over the used rows of all logs; x: [model.columns()]. weight: [n], 1 /
// variance. committed, eta: where columns that depend on the estimate and nonlinear effects are taken. One pass sums
// the Gram matrix; if its scaled condition exceeds kNormalLimit, a second one factorises the rows instead.
Solved BatchLeastSquares(const codegen::Model& model, const std::vector<const Dataset*>& data,
                         const Eigen::VectorXd& weight, const Eigen::VectorXd& committed, std::span<const double> eta);

}  // namespace armcal::calibration
