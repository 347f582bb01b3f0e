// calibration - fits parameters to data so that they stay near a prior and every body can exist.
//
// FitWithBarrier does this for a whole arm. It minimises over t
//   C(x(t)) + 1/2 |(t - t0) / sd|^2 - eps/2 sum_links logdet J_link(t) - eps/2 sum log rotor,   eps = 1, 0.1, 0.01.
// t holds (m, c, I about the centre, rotor) of each link and the other coordinates as they are. J is the 4x4
// pseudo-inertia (Wensing, Kim, Slotine 2018). C is half the weighted sum of squares of the data. The steps are those
// of Levenberg and Marquardt; a step that leaves the cone of possible bodies is rejected. The prior must lie inside the
// cone. Any choice of filter coordinates will do: x's rigid part is base_map times the bodies.
// NearestBody does the same for one body.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::calibration {

// C about x: C(x + d) = cost + gradient'd + d' hessian d / 2 (exact, or Gauss and Newton's).
struct DataTerm {
  double cost = 0;
  Eigen::VectorXd gradient;  // [x]
  Eigen::MatrixXd hessian;   // [x x x]
};

// This sum stays positive: base + bodies' (bodies about link origins) + x' x. x counts only where it is not rigid.
struct Limit {
  double base = 0;
  Eigen::VectorXd bodies, x;  // [11 n], [x]
};

struct BarrierProblem {
  const codegen::Model* model = nullptr;
  Eigen::VectorXd bodies;        // [11 n] prior mean about link origins, physical
  Eigen::VectorXd bodies_sd;     // [11 n] of (m, c, I about the centre, rotor); 0: held
  Eigen::VectorXd x, x_sd;       // [x] prior of the coordinates that are not rigid; sd 0: held, infinite: no prior
  Eigen::VectorXd lower, upper;  // [x] or empty: a step ends there
  std::vector<Limit> limits;
  // derivatives = false: cost alone is read.
  std::function<DataTerm(const Eigen::VectorXd& x, bool derivatives)> data;
  bool quadratic = true;  // the data term is quadratic; it is then asked once
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

// Throws io::InputError if a link of the robot file cannot exist (names the first), or if it has prior = "none".
void RequirePhysicalPrior(const codegen::Model& model);

// The body that can exist nearest to an estimate that perhaps cannot. With p = (m, m c, I about the origin) it
// minimises
//   (p - estimate)' information (p - estimate) / 2 - eps / 2 logdet J(p)
// with eps falling to 0.01. Both parts are convex, so Newton's method with step halving finds the minimum from any
// body. information: positive definite.
Eigen::VectorXd NearestBody(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& information);

// The linear map [10 x 10] of a body's ten parameters from one frame to another. pose [4x4]: of the first frame in the
// second.
Eigen::MatrixXd BodyMap(const Eigen::Matrix4d& pose);

}  // namespace armcal::calibration
