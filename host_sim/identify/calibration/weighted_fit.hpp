// calibration - weighted least squares with a prior, in double, and the standard parameters that follow from it.
// Every other estimate is compared with this one.
#pragma once

#include <vector>

#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

struct Fit {
  Eigen::VectorXd x;           // [columns + n] filter columns and torque gain deviations
  Eigen::VectorXd sd;          // posterior standard deviation (0 where not active)
  Eigen::VectorXd prior_sd;    // the prior's, in the same coordinates; infinity without prior
  Eigen::MatrixXd covariance;  // of all coordinates
  Eigen::VectorXd sigma;       // [n] residual standard deviation, used as weights
  Eigen::VectorXd inflation;   // [n] variance factor for residuals that are not white
  std::vector<int> active;
  std::vector<double> eta;  // nonlinear parameters of the model
  Information information;  // at the final estimate
  int iterations = 0;

  double ratio(int c) const { return prior_sd[c] > 0 ? sd[c] / prior_sd[c] : 1; }
};

// Iterates: the weights come from the residuals, the gain columns and those that depend on the estimate from the
// estimate. `held`: coordinates kept at the prior mean. Directions that neither data nor prior determine stay there,
// too.
Fit WeightedFit(const codegen::Model& model, const std::vector<const Dataset*>& data,
                const std::vector<int>& held = {});

// Minimum over active coordinates of the weighted residual plus the prior; returns x and (optionally) the covariance.
Eigen::VectorXd SolveWithPrior(const Information& info, const Eigen::VectorXd& weight, const Prior& prior,
                               const std::vector<int>& active, Eigen::MatrixXd* covariance);

// How much more a sum over these residuals varies than one over white residuals: 1 + 2 times the sum of the
// autocorrelations up to the first negative one.
double VarianceInflation(const Eigen::VectorXd& residual, const Eigen::VectorXi& used);

struct PhysicalReadOut {
  Eigen::VectorXd bodies;     // [11n] about link origins
  Eigen::VectorXd bodies_sd;  // [11n] posterior standard deviation of (m, c, I about the centre, rotor)
  Eigen::VectorXd x;          // [columns + n] the consistent filter coordinates
  int iterations = 0;
  bool converged = false;
};

// Half the weighted sum of squares of the logs about x. Its cost stays zero.
DataTerm LogsAbout(const Fit& fit, const Eigen::VectorXd& x);

// [n] N m sqrt(s): the deviation of one sample of the residual, times the root of the sample's time. A row of a joint
// whose band is limited is an average, which has less noise; there the samples count in which the joint moves.
Eigen::VectorXd NoiseDensity(const codegen::Model& model, const std::vector<const Dataset*>& data, const Fit& fit);

// Throws io::InputError if a link of the prior is not physical (names it), or if the robot has prior = "none".
PhysicalReadOut ReadOutPhysical(const codegen::Model& model, const Fit& fit);

}  // namespace armcal::calibration
