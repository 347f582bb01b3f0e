// replay - refines parameters by output error: simulated positions of many short free runs against the measured ones
// (multiple shooting).
//
// The error of one free run over a whole record has many minima, and a deep one is no sign of good parameters. So the
// training record is cut into segments. Each starts at the log's own smoothed state, where as many joints as can be
// move and do not turn, because nobody knows the state of friction near a turn. The length of the segments is chosen on
// the training logs alone: parts of them (blocks) are left out in turn, and the length wins whose parameters predict
// the left-out blocks best in one free run each. Beside the parameters, the zero of each torque may drift along a
// straight line during a log. That drift is a state of the run: it is fitted and left out of the result.
#pragma once

#include <cstdint>

#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "host_sim/identify/replay/free_run.hpp"

namespace armcal::replay {

// A training log: what was measured, and the state at each sample from both sides of it.
struct Training {
  Record record;
  Eigen::MatrixXd q, qd;  // [N x n] smoothed
  Eigen::MatrixXi used;   // [N x n] 1: this joint moves and does not turn
};
Training MakeTraining(const logs::Log& log, const calibration::Dataset& data);

struct RefineSettings {
  double step_s = 4e-3;  // of the simulation
  double block_s = 0;    // what is left out, and what a refit draws: the period of the motion; 0: a quarter of each log
  double segment_s = 0;  // 0: chosen
  int tries = 5;         // starting points: the fit itself, the others drawn around it
  std::uint64_t seed = 1;
  bool resample = false;  // blocks drawn with replacement, as many as there are
};

struct Refined {
  Eigen::VectorXd x;        // [columns + n] as in Fit
  std::vector<double> eta;  // those of the fit
  Eigen::MatrixXd drift;    // [logs x n] torque zero at the end of a log minus that in its middle
  Eigen::VectorXd rms;      // [n] position error over the segments
  double segment_s = 0;
  int segments = 0, tries = 0, agree = 0;  // agree: tries that end within 1 % of the smallest sum of squares;
                                           // 0: all of them ran away
  struct Length {
    double segment_s, error;  // error: of left-out blocks, in standard deviations of the joint's position
  };
  std::vector<Length> lengths;  // those that were compared; empty if the length was given
};

// fit: where to begin, and how far a parameter may go. InputError: a log shorter than a block, or no segment of any
// length can be simulated from the fit.
Refined Refine(const codegen::Model& model, const std::vector<Training>& logs, const calibration::Fit& fit,
               const RefineSettings& settings);

}  // namespace armcal::replay
