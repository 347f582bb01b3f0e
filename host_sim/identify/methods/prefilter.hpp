// methods - takes noise out of logs before a fit: a Fourier series of the motion, or one low-pass for all columns.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

inline constexpr int kFourierHarmonics = 15;  // (27) has 5; an arm that follows it adds some

// The log with q, qd, qdd of the Fourier series that fits best: an offset and `harmonics` harmonics of period_s. So the
// position has no noise, and derivatives need no differentiation. Rows whose joint then moves slower than v_min are not
// used any more. Torque stays as it is. For periodic excitation, before any method. InputError: fewer samples than
// coefficients, or a period longer than the log.
Dataset FourierFit(const codegen::Model& model, const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// Root mean square of q minus the series, per joint.
Eigen::VectorXd FourierResidual(const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// The period of a log that holds a whole number of periods: of length / k, k = 1 .. length / 1 s, the one that fits
// best.
double FindPeriod_s(const Dataset& log, int harmonics = kFourierHarmonics);

struct Decimation {
  double cutoff_Hz = 20;  // Butterworth of order 4, forward and backward; cut to 0.4 of the sample rate
  int every = 0;          // every how many-th row is kept; 0: so that the rows are independent behind the low-pass
};

// The survey's parallel decimation: torque and every column pass one low-pass, then every m-th row is kept. The columns
// of sgn(qd) must pass it like the torque, or friction would be biased. A row counts if all samples within half a
// period of the cut-off are used. The rows are whitened as by Linearise; the weights count the noise that the filter
// leaves.
Linearised FilteredRows(const Problem& problem, const Eigen::VectorXd& z, const Decimation& decimation = {});

}  // namespace armcal::calibration
