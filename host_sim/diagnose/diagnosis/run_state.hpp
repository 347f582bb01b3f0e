// diagnosis - what a run-state term becomes on another run: a level that wanders, followed as the samples come; knows
// no kind.
#pragma once

#include "host_sim/diagnose/diagnosis/candidate.hpp"

namespace armcal::diagnosis {

// A term whose shape over the joints is known from training, times one level that is not known.
struct RunState {
  const Candidate* candidate = nullptr;
  std::vector<double> eta;
  Eigen::VectorXd amplitude;  // of the columns at level one
  double time_s = 0;          // at this time of the training run all of the term was there
  double level_sd = 1;        // how large the level may be at the start
  double variance_ps = 0;     // of the level's random walk, per second
};

// From the term as fitted to a training run of this length: its level's squared changes over the run's length,
// less where it is smooth.
RunState MakeRunState(const Candidate& candidate, const std::vector<double>& eta, const Eigen::VectorXd& amplitude,
                      double train_s);

// Torque [N x n] that a Kalman filter of the level predicts one sample ahead, from the residuals before. sigma: [n]
// noise of a residual.
Eigen::MatrixXd Track(const RunState& state, const Quantities& quantities, const Eigen::MatrixXd& residual,
                      const Eigen::VectorXd& sigma);

}  // namespace armcal::diagnosis
