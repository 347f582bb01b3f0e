// methods - the survey's parallel decimation: torque and every column through one low-pass, then every m-th
// row; knows no method.
#pragma once

#include "host_sim/identify/methods/linearised.hpp"

namespace armcal::calibration {

struct Decimation {
  double cutoff_Hz = 20;  // Butterworth of order 4, forward and backward; cut to 0.4 of the sample rate
  int every = 0;          // rows kept: 1, 2 ...; 0: as many as the low-pass leaves independent
};

// Whitened rows as Linearise gives them, filtered: the columns of sgn(qd) pass the same filter as the torque, or
// friction would be biased (survey-study's trap). A row counts where the samples within half a period of the cut-off
// are all used. The noise left by the filter is in the weights.
Linearised FilteredRows(const Problem& problem, const Eigen::VectorXd& z, const Decimation& decimation = {});

}  // namespace armcal::calibration
