// calibration - says what a held-out log can tell beside the logs that a model is fitted to: whether it is another
// motion, whether it stays where they were, and which joints they do not tell apart.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

// A part of the held-out log that a training log holds, too.
struct Repeated {
  double share = 0;    // of the held-out log's time in motion; 0: none
  std::string source;  // the training log that has most of it
};

// Where a joint of the held-out log is outside of what training has shown.
struct Outside {
  double position = 0, speed = 0;  // shares of its moving samples outside of the training logs' range
  double leverage = 1;  // the model's variance of this joint's torque there, over that on the training logs (means)
  bool beyond() const;  // more than a twentieth of the samples, or a standard deviation of more than twice
};

struct HeldOutMotion {
  Repeated samples;     // the same measured torques, one after the other
  Repeated trajectory;  // the same positions up to a shift of time
  std::vector<Outside> joint;
  // Joints of the training logs whose positions and speeds are proportional; together: in the held-out log, too.
  struct InPhase {
    std::vector<int> joints;  // 0-based
    bool together = false;
  };
  std::vector<InPhase> in_phase;

  // At least half of it is a training log's trajectory: it cannot confirm what was found there.
  bool repeats() const;
};

// fit: of the model to the training logs. The comparison of trajectories takes 40 samples a second of windows of 2 s,
// and demands of every joint that moves that it stays within 3 % of its own standard deviation.
HeldOutMotion CompareMotion(const codegen::Model& model, const Fit& fit, const std::vector<const Dataset*>& train,
                            const Dataset& test);

}  // namespace armcal::calibration
