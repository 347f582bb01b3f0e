// logs - derives speed and acceleration of a log from its sampled positions. Torque is never filtered: a low-pass
// would remove the ripple that is looked for.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "host_sim/data/logs/log.hpp"

namespace armcal::logs {

// Shapes [N x n], on the log's own time grid.
struct Derivatives {
  Eigen::MatrixXd q, qd, qdd;  // rad, rad/s, rad/s^2 (m ...)
  Eigen::VectorXd cutoff_Hz;   // [n] what each joint's q was filtered with
  Eigen::VectorXi settled;     // [N] 0 within 3 periods of the lowest cut-off from an end or a wide gap, else 1
};

// Of the sample rate: no cut-off is higher, because the filter needs room below half the rate.
inline constexpr double kHighestOfRate = 0.4;

// True for the highest cut-off: a position with this cut-off is not smoothed. Time stamps are rounded and jitter, so
// the rate that the cut-off was chosen with and rate_Hz may differ by up to 1 %.
bool IsHighest(double cutoff_Hz, double rate_Hz);

// What the choice of a joint's cut-off rests on.
struct JointNoise {
  double position_rad = 0;  // standard deviation of q's sample noise (encoder step / sqrt 12, or more if q is noisier)
  double torque_Nm = 0;     // sample-to-sample jitter of the torque (standard deviation)
  double band_Hz = std::numeric_limits<double>::infinity();  // up to which q moves more than its noise
};
JointNoise EstimateNoise(const Log& log, int joint);

// What the noise of derived signals must stay small against.
struct Sensitivity {
  Eigen::MatrixXd inertia;                // [n x n] a typical mass matrix, kg m^2 (kg)
  Eigen::VectorXd sign_width_radps = {};  // [n] speed over which friction changes its sign; empty: not looked at
};

// The highest cut-off below 60 Hz and 0.4 of the sample rate at which inertia x (noise of qdd that the encoder causes)
// stays below 0.07 of the torque's jitter and the noise of qd below 0.05 of the speed over which friction changes sign.
// inertia: joint side, kg m^2 (kg).
double QuietCutoff_Hz(const JointNoise& noise, double inertia, double rate_Hz,
                      double sign_width_radps = std::numeric_limits<double>::infinity());

// Not below this cut-off is a joint's motion filtered: 20 Hz or, where that is less, 1.5 times the motion's band, but
// at least 2 Hz. A joint that stands has no band of its own.
double MotionCutoff_Hz(const JointNoise& noise, double rate_Hz);

// The cut-off of all joints: chosen for each, or the user's own.
struct Bandwidth {
  double cutoff_Hz = 0;          // 0: ChooseCutoffs_Hz
  double scale = 1;              // multiplies either: 0.62 shows which findings depend on it
  Eigen::VectorXd each_Hz = {};  // [n] one a joint, instead of either
};

// q through a zero-phase Butterworth of order 4 (run forward and backward), then derivatives of a quintic spline.
// An irregular grid is resampled by a quintic spline first. A gap of more than five sample times is filled by a cubic
// through the samples beside it. Positions are never carried across a gap of more than five sample times and more than
// 12.5 ms; a piece too short for the spline keeps its q and has zero derivatives (settled = 0).
// InputError: wrong number of
// inertias, fewer than 8 samples, a cut-off from half the sample rate on or so low that no sample is settled.
Derivatives DeriveSignals(const Log& log, const Sensitivity& sensitivity, const Bandwidth& bandwidth = {});

// [n] Of each joint the quiet cut-off, or the motion's where that is higher. One joint's acceleration is in every
// joint's torque: the most sensitive one decides.
Eigen::VectorXd ChooseCutoffs_Hz(const Log& log, const Sensitivity& sensitivity);

// The frequency [Hz] above which evenly sampled q shows less power than white noise of this standard deviation would.
// Welch's periodogram of the second difference. 0 if q only holds noise;
// half the rate if it is too short to tell.
double MotionBand_Hz(const Eigen::VectorXd& q, double noise, double rate_Hz);

}  // namespace armcal::logs
