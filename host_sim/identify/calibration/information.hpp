// calibration - what logs say about the parameters: sums for each joint, without storing the regressor.
#pragma once

#include <span>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// Sums over the used rows of each joint j, in the coordinates x (all filter columns and kappa). Not weighted by sigma.
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

// Evaluates the model over the data in blocks. Columns that depend on the estimate, and the gain columns, are taken at
// p.
Information Accumulate(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& p,
                       std::span<const double> eta);

// The model's torque [N x n]: (1 + kappa_j) Y_j p.
Eigen::MatrixXd ModelTorque(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                            std::span<const double> eta);
// The same as the log's torque channel would have measured it.
Eigen::MatrixXd Predict(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                        std::span<const double> eta);

}  // namespace armcal::calibration
