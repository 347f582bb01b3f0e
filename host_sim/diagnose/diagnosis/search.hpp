// diagnosis - finds a candidate's best nonlinear parameters, the way its record asks for; knows no kind by name.
#pragma once

#include <vector>

#include "host_sim/diagnose/diagnosis/evidence.hpp"
#include "host_sim/diagnose/diagnosis/metric.hpp"

namespace armcal::diagnosis {

// The base model on all rows and on the thinned ones.
struct Ground {
  const Evidence& evidence;
  const Thinned& thinned;
  const Metric& metric;
  const Metric& thin_metric;
};

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
