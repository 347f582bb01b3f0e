// diagnosis - finds a candidate's best nonlinear parameters, the way its record asks for; knows no kind by name.
#pragma once

#include <cmath>
#include <vector>

#include "host_sim/diagnose/diagnosis/metric.hpp"

namespace armcal::diagnosis {

// All training logs with the current estimate's model torque.
struct Evidence {
  const codegen::Model* model = nullptr;
  std::vector<Quantities> logs;
  std::vector<RowIndex> index;  // [n] used rows over all logs
};

// The candidate's columns at eta over the used rows of its joints.
Columns GatherColumns(const Candidate& candidate, const Evidence& evidence, const std::vector<double>& eta);

// Every m-th sample of the evidence, for a rough search. Torque is averaged about it, so that little of what the log
// tells is lost. So are columns that all samples must be evaluated for; the others are smooth over so short a time.
struct Thinned {
  // Keeps about `rows` samples a log.
  Thinned(const Evidence& evidence, int rows);
  Columns Gather(const Candidate& candidate, const std::vector<double>& eta) const;
  BaseRows Average(const BaseRows& all) const;
  Eigen::MatrixXd AverageRows(const Eigen::MatrixXd& m, int j) const;
  // Noise of an averaged row, and how much of a gain is left, of white noise.
  double noise() const { return 1 / std::sqrt(2.0 * reach + 1); }
  double share() const { return (2.0 * reach + 1) / every; }

  const Evidence& all;
  int every = 1, reach = 0;  // a row stands for the samples that far about it
  std::vector<std::unique_ptr<calibration::Dataset>> data;
  std::vector<Quantities> logs;
  std::vector<std::vector<int>> kept;  // [n] places in all.index[j]
  std::vector<RowIndex> index;         // [n] of the shorter logs
};

// The base model on all rows and on the thinned ones.
struct Ground {
  const Evidence& evidence;
  const Thinned& thinned;
  const Metric& metric;
  const Metric& thin_metric;
};

// The excitation the record asks for is in the logs.
bool IsExcited(const Candidate& candidate, const Evidence& evidence);

struct Found {
  Candidate* candidate = nullptr;
  std::vector<double> eta;
  Gain gain;
  double tried = 1;           // members of the grid: many tries find something by chance
  int searched = 0;           // unknowns that were looked for: parameters, too
  bool rough = false;         // gain, as the thinned rows have it, of all rows
  Eigen::MatrixXd precision;  // of a curve's coefficients; empty for others
  double penalty = 0;         // of its freedom: what so many parameters gain by chance, and more
  double score = 0;
};

// gain - penalty - 2 ln(tried) - the record's own penalty.
double Score(const Found& found, double gain);
// parameters ln(rows), as the Bayesian information criterion has it.
double PenaltyOf(int parameters, const Candidate& candidate, const Evidence& evidence);

// Roughly, wherever thinned rows can tell. Amplitudes outside the record's bounds gain nothing. simpler: what the
// record after which this one is tried has found on the same joints; the unknowns that they share start there.
Found SearchCandidate(Candidate& candidate, const Ground& ground, const Found* simpler = nullptr);
// The same on all rows.
Found Finish(const Found& rough, const Ground& ground);

}  // namespace armcal::diagnosis
