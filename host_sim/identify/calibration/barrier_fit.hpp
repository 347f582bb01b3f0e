// calibration - parameters that fit, stay near a prior given in table coordinates and are real bodies; knows no log.
//
// min over t of  C(x(t)) + 1/2 |(t - t0) / sd|^2 - eps/2 sum_links logdet J_link(t) - eps/2 sum log rotor,
// eps = 1, 0.1, 0.01; t = (m, c, I about the centre, rotor) per link and the remaining coordinates as they are; J the
// 4x4 pseudo-inertia (Wensing, Kim, Slotine 2018); C half the weighted sum of squares of the data. Levenberg-Marquardt;
// a step that leaves the cone is rejected. The prior must lie inside the cone. It works for any choice of filter
// coordinates: x's rigid part is base_map times the bodies.
#pragma once

#include <atomic>
#include <functional>

#include <Eigen/Core>

#include "codegen/src/generator/model.hpp"

namespace armcal::calibration {

// C about x: C(x + d) = cost + gradient'd + d' hessian d / 2 (exact, or Gauss and Newton's).
struct DataTerm {
  double cost = 0;
  Eigen::VectorXd gradient;  // [x]
  Eigen::MatrixXd hessian;   // [x x x]
};

struct BarrierProblem {
  const codegen::Model* model = nullptr;
  Eigen::VectorXd bodies;        // [11 n] prior mean about link origins, physical
  Eigen::VectorXd bodies_sd;     // [11 n] of (m, c, I about the centre, rotor); 0: held
  Eigen::VectorXd x, x_sd;       // [x] prior of the coordinates that are no rigid ones; sd 0: held, infinite: no prior
  Eigen::VectorXd lower, upper;  // [x] or empty: a step ends there
  // derivatives = false: cost alone is read.
  std::function<DataTerm(const Eigen::VectorXd& x, bool derivatives)> data;
  bool quadratic = true;  // the data term is: asked once
  const std::atomic<bool>* stop = nullptr;
};

struct BarrierFit {
  Eigen::VectorXd bodies;      // [11 n] about link origins
  Eigen::VectorXd bodies_sd;   // [11 n] posterior, of (m, c, I about the centre, rotor)
  Eigen::VectorXd x;           // [x] consistent with the bodies
  Eigen::MatrixXd covariance;  // [x x x] posterior
  int iterations = 0;
  bool converged = false;
};

BarrierFit FitWithBarrier(const BarrierProblem& problem);

// Throws io::InputError naming the first link of the robot file that cannot exist; or if it has prior = "none".
void RequirePhysicalPrior(const codegen::Model& model);

}  // namespace armcal::calibration
