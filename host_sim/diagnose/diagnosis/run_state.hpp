// diagnosis - what belongs to a run and not to the arm: how it may change, and how it is followed on another run.
#pragma once

#include <string>

#include "host_sim/diagnose/diagnosis/work.hpp"

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

// Why a torque over time cannot be a state of the run; empty: it can, or the candidate is none. amplitude: of cubic
// B-splines on even knots, without the first one. What changes during a run, such as a sensor's zero or a lubricant,
// goes one way, or there and back. A torque that goes to and fro follows the motion. One that stays is an offset.
std::string WhyNoState(const Candidate& candidate, const Eigen::VectorXd& amplitude);

// On another run it moves as far as in training, and to and fro. residual: [N x n] what that run leaves
// without the term. amplitude: as fitted in training.
bool GoesToAndFroOn(const Candidate& candidate, const Eigen::VectorXd& amplitude, const Quantities& quantities,
                    const Eigen::MatrixXd& residual);

}  // namespace armcal::diagnosis
