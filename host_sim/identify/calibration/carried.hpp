// calibration - asks whether a run carries another payload at the flange than the runs that a model was fitted to.
//
// Each half of the run is fitted by itself and judged on the other half: what the model leaves is
//   r_j = Y_j d + P_j load + noise.
// P_j are the last link's columns about the flange. d is what may differ between two runs of one arm without a payload:
// the model's parameters within their covariance, each joint's friction and torque gain by some per cent. A payload is
// named only if it predicts both halves better than d alone does, on two joints or more, and if both halves give it a
// mass of one sign.
#pragma once

#include <array>
#include <vector>

#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

inline constexpr double kUnstatedTolerance = 0.1;  // of a torque constant whose tolerance nobody states

struct Carried {
  bool named = false;
  // Against the training runs: negative where the held-out run carries less. About the flange's origin, in its axes:
  // m, m c, I (xx xy xz yy yz zz).
  Eigen::VectorXd load;           // [10] of the whole run
  double mass_kg = 0, sd_kg = 0;  // sd: also how far the halves disagree
  // Holds the true mass if each joint's gain is within the tolerance; widened by two standard deviations.
  std::array<double, 2> interval_kg{};
  double tolerance = 0;                         // the largest of the joints
  bool tolerance_stated = false;                // by the robot file for every joint, or by the caller
  std::array<Eigen::VectorXd, 2> half;          // [10] load of each half
  std::array<double, 2> half_sd_kg{}, score{};  // score of a half: what it tells in favour of the other half's payload
  // Of the errors of each half with the other half's payload over those without, geometric mean over the joints; and
  // how many joints gain on both halves.
  std::array<double, 2> factor{1, 1};
  int joints = 0;
  int begin_second = 0;  // the first sample of the second half

  // What each half's load adds to the coordinates [columns + n] of the model; half 0 or 1.
  Eigen::VectorXd Coordinates(const codegen::Model& model, int half) const;
};

// residual: [N x n] measured minus predicted torque of `run`. fit: of the model to its training logs; sigma: [n] what
// the model leaves there. tolerance: of every joint's torque gain (half width); 0: the robot file's own, or
// kUnstatedTolerance where it states none.
Carried FindCarried(const codegen::Model& model, const Fit& fit, const Eigen::VectorXd& sigma, const Dataset& run,
                    const Eigen::MatrixXd& residual, double tolerance = 0);

}  // namespace armcal::calibration
