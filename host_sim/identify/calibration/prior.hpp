// calibration - what is known before any log: bodies, friction, effects and torque gains, each as a Gaussian.
#pragma once

#include <Eigen/Core>

#include "codegen/src/generator/model.hpp"

namespace armcal::calibration {

// Coordinates of a fit: x = [filter columns, torque gain deviations kappa (one a joint)].
// measured torque_j = (1 + kappa_j) * (Y_j p). A torque constant that is off by its tolerance is an ordinary error of a
// parameter.
struct Prior {
  Eigen::VectorXd mean;        // [columns + n]
  Eigen::MatrixXd covariance;  // the bodies' part is B J diag(sd^2) J' B', full; empty: nothing at all is known
  std::vector<int> active;     // coordinates that a fit may move
  // false: prior = "none". The covariance is then a diagonal one: each column alone, over motions within the arm's
  // limits, makes the torque that its joints can give. It holds what the logs do not determine near the mean.
  bool informative = true;
  int columns = 0;
};

using codegen::OriginJacobian;
using codegen::ToCentre;
using codegen::ToOrigin;

// From the model's table: means, deviations and states.
Prior MakePrior(const codegen::Model& model);

// Means of the model's nonlinear parameters, as the table has them.
std::vector<double> MeanUnknowns(const codegen::Model& model);

// R with R R' = covariance, which may be singular; found in units of its deviations.
Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance);

// Means of the body parameters about the link origins, [11n].
Eigen::VectorXd BodyMean(const codegen::Model& model);

// Standard parameters from base ones: phi = phi0 + G (b - B phi0), G = P0 B' (B P0 B')^-1.
Eigen::VectorXd ReadOutBodies(const codegen::Model& model, const Eigen::VectorXd& base);

// [[tr(I)/2 E - I, mc], [mc', m]] of a body about its link origin; body: its 10 values.
Eigen::Matrix4d PseudoInertia(const double* body);

// Every link's pseudo-inertia is positive definite.
bool IsPhysical(const Eigen::VectorXd& bodies);

}  // namespace armcal::calibration
