// calibration - finds the band in which a log's torque and its model can agree, and averages rows down to that band.
#pragma once

#include <Eigen/SparseCore>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// How the measured torque y of one joint follows the prediction x over frequency, in bands of a third of an octave.
// Noise in the derived speed and acceleration is in x alone: it lowers `gain`, while `inverse_gain` stays at 1 or
// above. A late or filtered torque channel lowers both, and the coherence stays high.
struct TransferBand {
  double lower_Hz = 0, upper_Hz = 0;
  double gain = 0, gain_sd = 0;  // |S_xy| / S_xx
  double inverse_gain = 0;       // S_yy / |S_xy|
  double coherence = 0;          // 0 to 1
};
std::vector<TransferBand> Transfer(const Dataset& data, int joint, const Eigen::VectorXd& predicted);

// The frequency above which the prediction of this joint is mostly noise of the derived signals; infinity: nowhere
// below half the sample rate.
double AgreedBand_Hz(const std::vector<TransferBand>& transfer);

// The frequency above which the torque of a log was filtered away when it was brought to its rate: there it falls by two
// decades of power or more against the prediction, within half an octave. Lower edges than a ninth of the rate are not
// looked for: motion ends there, and what is left of the prediction is noise. Infinity: nowhere.
double FilteredAbove_Hz(const Dataset& data, int joint, const Eigen::VectorXd& predicted);

// A predicted torque [N x n] as the log's torque channels would have saved it.
Eigen::MatrixXd AsSaved(const Dataset& data, Eigen::MatrixXd torque);

// One row a half period of band_Hz: the Gaussian average, 3 dB down at band_Hz, of the used samples about it. Columns
// and torque pass the same average, so a model that holds at every sample holds for the rows. [rows x samples]
Eigen::SparseMatrix<double, Eigen::RowMajor> AverageRows(const Dataset& data, int joint);

}  // namespace armcal::calibration
