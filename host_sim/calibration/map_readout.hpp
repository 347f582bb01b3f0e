// calibration - the physical read-out: standard parameters that fit the data, stay near the prior and are real bodies.
//
// min over t of  sum_j w_j |tau_j - Y_j x(t)|^2 + |(t - t0)/sd|^2 - eps sum_links logdet J_link(t) - eps sum log rotor,
// eps = 1, 0.1, 0.01, t = (m, c, I about the centre, rotor) per link and the remaining columns as they are; J the 4x4
// pseudo-inertia (Wensing, Kim, Slotine 2018). Levenberg-Marquardt; a step that leaves the cone is rejected. The prior
// must lie inside the cone.
#pragma once

#include "host_sim/calibration/weighted_fit.hpp"

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
