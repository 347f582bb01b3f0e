// calibration - the physical read-out: standard parameters that fit the data, stay near the prior and are real bodies
// (barrier_fit.hpp says how); knows no log.
#pragma once

#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

struct PhysicalReadOut {
  Eigen::VectorXd bodies;     // [11n] about link origins
  Eigen::VectorXd bodies_sd;  // [11n] posterior standard deviation of (m, c, I about the centre, rotor)
  Eigen::VectorXd x;          // [columns + n] the consistent filter coordinates
  int iterations = 0;
  bool converged = false;
};

// Throws io::InputError if a link of the prior is not physical (names it), or if the robot has prior = "none".
PhysicalReadOut ReadOutPhysical(const codegen::Model& model, const Fit& fit);

}  // namespace armcal::calibration
