// calibration - the least-squares information of logs, joint by joint, never the stacked regressor; knows no prior.
#pragma once

#include <span>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// For each joint j and coordinates x (all filter columns and kappa): sums over used rows, unweighted by sigma.
struct Information {
  std::vector<Eigen::MatrixXd> gram;   // [n] A_j' A_j
  std::vector<Eigen::VectorXd> right;  // [n] A_j' tau_j
  Eigen::VectorXd square;              // [n] tau_j' tau_j
  Eigen::VectorXi rows;                // [n]

  Information() = default;
  Information(int joints, int coordinates);
  Information& operator+=(const Information& other);
  // Sum of squared residuals of joint j at x.
  double Residual(int j, const Eigen::VectorXd& x) const;
};

// Evaluates the model over the data in blocks. p: the estimate at which estimate-dependent columns and the gain columns
// are taken.
Information Accumulate(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& p,
                       std::span<const double> eta);

// Predicted torque [N x n]: (1 + kappa_j) Y_j p.
Eigen::MatrixXd Predict(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                        std::span<const double> eta);

}  // namespace armcal::calibration
