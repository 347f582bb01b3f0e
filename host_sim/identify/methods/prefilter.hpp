// methods - takes noise out of logs before a fit: a Fourier series of the motion, or one low-pass for all columns.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

inline constexpr int kFourierHarmonics = 15;  // (27) has 5; an arm that follows it adds some

// The log with q, qd, qdd of the least-squares series offset + sum_{h = 1 .. harmonics} of period_s; rows whose joint
// then moves slower than v_min are not used any more. Torque stays as it is. Use before any method, where the
// excitation is periodic. InputError: fewer samples than coefficients, or a period beyond the log's length.
Dataset FourierFit(const codegen::Model& model, const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// Root mean square of q minus the series, per joint.
Eigen::VectorXd FourierResidual(const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// The period of a log that holds a whole number of them: of length / k, k = 1 .. length / 1 s, the one that fits best.
double FindPeriod_s(const Dataset& log, int harmonics = kFourierHarmonics);

struct Decimation {
  double cutoff_Hz = 20;  // Butterworth of order 4, forward and backward; cut to 0.4 of the sample rate
  int every = 0;          // rows kept: 1, 2 ...; 0: as many as the low-pass leaves independent
};

// Whitened rows as Linearise gives them, filtered: the columns of sgn(qd) pass the same filter as the torque, or
// friction would be biased (survey-study's trap). A row counts where the samples within half a period of the cut-off
// are all used. The noise left by the filter is in the weights.
Linearised FilteredRows(const Problem& problem, const Eigen::VectorXd& z, const Decimation& decimation = {});

}  // namespace armcal::calibration
