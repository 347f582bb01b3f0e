// calibration - makes a log ready for estimation: the signals of each sample, and which rows may be used.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <limits>
#include <vector>

#include "codegen/src/generator/model.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/data/logs/signals.hpp"

namespace armcal::calibration {

// How a joint's torque was measured, where a log shows it: late by late_s, and through so many equal low-passes of
// first order with the time constant lag_s.
struct JointChannel {
  double lag_s = 0, late_s = 0;
  int lags = 1;
  bool empty() const { return lag_s == 0 && late_s == 0; }
};
using TorqueChannel = std::vector<JointChannel>;  // [n]; empty: as it is

// N samples, n joints.
struct Dataset {
  codegen::Signals s;         // q, qd, qdd (derived from q where the log has no better), temp
  Eigen::MatrixXd tau;        // [N x n] measured torque minus known external torque
  Eigen::MatrixXi moving;     // [N x n] 1: |qd| > v_min of that joint, and not beside a jolt
  Eigen::MatrixXi used;       // [N x n] 1: row may be fitted (moving, signals settled, drive did not flag it)
  Eigen::MatrixXi slides;     // [N x n] 1: used before UseTurns
  Eigen::MatrixXi sound;      // [N x n] 1: signals settled and not flagged, also near turns and at rest
  Eigen::VectorXi scored;     // [N] 1: at least 0.5 s away from both ends of the log
  Eigen::VectorXd cutoff_Hz;  // [n]
  Eigen::VectorXd band_Hz;    // [n] up to which torque and model are compared; infinity: as far as the log goes
  Eigen::VectorXd saved_Hz;   // [n] above it the torque was filtered away before it was saved; infinity: nowhere
  TorqueChannel channel;      // predictions and columns pass it before they are compared with tau
  // [n] where the band is limited: the averages of samples that are fitted. Elsewhere empty: each used sample is a row.
  std::vector<Eigen::SparseMatrix<double, Eigen::RowMajor>> average;
  Eigen::MatrixXd reference;  // [N x n] commanded position; empty where the log has none
  std::string source;
  int per_sample = 1;  // N - 1 over the log's own samples - 1: a filtered log is computed on a finer grid

  int samples() const { return s.samples(); }
  double rate_Hz() const { return static_cast<double>(s.t.size() - 1) / (s.t[s.t.size() - 1] - s.t[0]); }
  int joints() const { return static_cast<int>(tau.cols()); }
  bool averaged(int j) const { return static_cast<std::size_t>(j) < average.size() && average[j].cols() > 0; }
};

// The cut-off and the band depend on the arm's inertia. That comes from the prior or, without one, from a first fit of
// this log.
Dataset Prepare(const codegen::Model& model, const logs::Log& log, const logs::Bandwidth& bandwidth = {});

// From now on this joint's rows near turns and at rest are used, too.
void UseTurns(Dataset& data, int joint);

// The log with so few samples that its averages still hold ten a period of the widest band; torque is the mean about
// each kept sample. The same log where a joint's band is not limited.
Dataset ThinToBand(const Dataset& data);

// RMS over some poses of each entry of the mass matrix [n x n], for given base parameters.
Eigen::MatrixXd TypicalMass(const codegen::Model& model, const Eigen::VectorXd& base);

// Root mean square of residual[:, j] over scored samples of each joint; moving_only: where that joint moves.
Eigen::VectorXd Rms(const Dataset& d, const Eigen::MatrixXd& residual, bool moving_only);

// The same of each joint's rows: averages where its band is limited, else the scored samples where it moves.
Eigen::VectorXd RmsInBand(const Dataset& d, const Eigen::MatrixXd& residual);

// Every log has commanded positions.
bool HaveReferences(const std::vector<Dataset>& data);

// The names of the logs.
std::vector<std::string> Sources(const std::vector<Dataset>& data);

std::vector<const Dataset*> Pointers(const std::vector<Dataset>& data);

// The same log for a torque that is read late: position, speed and acceleration are those of delay_s before each torque
// sample, cubic between samples and held at the ends. A row stays in use if the rows are in use between which its
// motion is read.
Dataset Delayed(const Dataset& data, double delay_s);

}  // namespace armcal::calibration
