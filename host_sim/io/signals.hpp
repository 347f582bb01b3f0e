// io - position, speed and acceleration of a log from its sampled positions; knows no model. Torque is never filtered:
// a low-pass would remove the ripple that one looks for.
#pragma once

#include <Eigen/Core>

#include "host_sim/io/log.hpp"

namespace armcal::io {

// Shapes [N x n], on the log's own time grid.
struct Derivatives {
  Eigen::MatrixXd q, qd, qdd;  // rad, rad/s, rad/s^2 (m ...)
  Eigen::VectorXd cutoff_Hz;   // [n] what each joint's q was filtered with
  Eigen::VectorXi settled;     // [N] 0 within 3 periods of the lowest cut-off from an end or a wide gap, else 1
};

// What the choice of a joint's cut-off rests on.
struct JointNoise {
  double position_rad = 0;  // standard deviation of q's sample noise (encoder step / sqrt 12, or more if q is noisier)
  double torque_Nm = 0;     // sample-to-sample jitter of the torque (standard deviation)
};
JointNoise EstimateNoise(const Log& log, int joint);

// The highest cut-off in 20-60 Hz, and below 0.4 of the sample rate, at which inertia x (noise of qdd that the encoder
// causes) stays below 0.07 of the torque's jitter. inertia: joint side, kg m^2 (kg).
double ChooseCutoff_Hz(const JointNoise& noise, double inertia, double rate_Hz);

// q through a zero-phase Butterworth of order 4 (run forward and backward), then derivatives of a quintic spline.
// An irregular grid is resampled by a quintic spline first. Positions are never carried across a gap of more than five
// sample times; a piece too short for the spline keeps its q and has zero derivatives (settled = 0).
// inertia_per_joint: [n], a typical diagonal of the mass matrix; cutoff_scale multiplies every chosen cut-off (0.62
// shows which findings hang on it). InputError: wrong number of inertias, fewer than 8 samples.
Derivatives DeriveSignals(const Log& log, const Eigen::VectorXd& inertia_per_joint, double cutoff_scale = 1);

}  // namespace armcal::io
