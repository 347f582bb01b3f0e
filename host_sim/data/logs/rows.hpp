// logs - decides which rows of a file are samples, and which time each one has.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace armcal::logs {

// N rows as they stand in the file; n joints. A number that is missing is NaN.
struct RawRows {
  Eigen::VectorXd t;                 // [N] s
  Eigen::MatrixXd q, tau;            // [N x n]
  Eigen::VectorXi missing;           // [N] 1: some column has no number there
  std::string source, time_column;   // for messages
  std::vector<std::string> columns;  // the joints' columns of q, then of tau, for messages
  int first_line = 2;                // the number that messages give the first row: in a file, behind the header
};

struct Samples {
  std::vector<Eigen::Index> row;   // rows that are samples, ascending
  Eigen::VectorXd t;               // their times, strictly rising
  std::vector<std::string> notes;  // what was left out or changed: how many rows, and the first line
};

// Leaves out, each with a note:
// - rows without a number: any that pad the log's ends, and a tenth of the rest at most;
// - rows whose time is repeated or goes back: one row in a hundred at most, five in a short log;
// - filler: rows at an end that repeat all positions and torques, and rows of zeros;
// - rows that repeat the row before while the arm moves on. If each value stands k times (of the positions or of the
//   torques), only the rows with a fresh value stay.
// Stamps that jitter while the motion is evenly sampled are made even.
// InputError, one line with file, line and column: more rows than that have no number or no rising time; or the sample
// rate is below 1 Hz or above 50 kHz, which means that time has another unit.
Samples ChooseSamples(const RawRows& rows);

}  // namespace armcal::logs
