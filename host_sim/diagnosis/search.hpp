// diagnosis - finds a candidate's best nonlinear parameters, the way its record asks for; knows no kind by name.
#pragma once

#include <vector>

#include "host_sim/diagnosis/metric.hpp"

namespace armcal::diagnosis {

// All training logs with the current estimate's model torque.
struct Evidence {
  const codegen::Model* model = nullptr;
  std::vector<Quantities> logs;
  std::vector<RowIndex> index;  // [n] used rows over all logs
};

// The candidate's columns at eta over the used rows of its joints.
Columns GatherColumns(const Candidate& candidate, const Evidence& evidence, const std::vector<double>& eta);

// The excitation the record asks for is in the logs.
bool IsExcited(const Candidate& candidate, const Evidence& evidence);

struct Found {
  const Candidate* candidate = nullptr;
  std::vector<double> eta;
  Gain gain;
  int tried = 1;       // members of the grid: many tries find something by chance
  int parameters = 0;  // linear directions + nonlinear parameters that were searched
  double score = 0;
};

// gain - parameters ln(rows) - 2 ln(tried) - the record's own penalty.
double Score(const Found& found, double gain, const Evidence& evidence);

// Amplitudes outside the record's bounds gain nothing.
Found SearchCandidate(Candidate& candidate, const Evidence& evidence, const Metric& metric);

}  // namespace armcal::diagnosis
