// diagnosis - finds the best nonlinear parameters of a candidate, in the way that its record asks for.
#pragma once

#include <memory>
#include <vector>

#include "host_sim/diagnose/diagnosis/candidate.hpp"
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
  double tried = 1;                        // members of the grid: many tries find something by chance
  int searched = 0;                        // unknowns that were searched; they count as parameters
  bool rough = false;                      // the gain of all rows is estimated from the thinned ones
  std::shared_ptr<const CurveOdds> curve;  // null for others
  Eigen::MatrixXd precision;               // of a curve's coefficients; empty for others
  double penalty = 0;                      // what its parameters cost at most; not of a curve
  double rated = 0;                        // the gain that score and chance stand for
  double score = 0;
  double log_chance = 0;
};

// What its parameters cost. Of k parameters each costs ln(gain / k), as under a prior whose width makes the gain the
// likeliest (local empirical Bayes), at least 1, and at most ln(rows). With ln(rows) alone a true term of three
// parameters that gains 40 loses to an untrue one of one parameter that gains 23. A curve costs its gain less its
// evidence.
double PriceOf(const Found& found, double gain);
// gain - price - 2 ln(tried) - the record's own penalty.
double Score(const Found& found, double gain);
// The gain whose score is zero.
double GainOfScore(const Found& found);
// Natural logarithm of the chance that noise alone gains so much, at most, wherever a search of this kind looks. Of a
// curve it is the odds against it: its coefficients are averaged over, not fitted.
double LogChance(const Found& found, double gain);
// The gain that has such a chance.
double GainOfChance(const Found& found, double log_chance);
// Takes this as its gain.
void Rate(Found& found, double gain);
// ln P(chi^2 > x) for so many degrees of freedom.
double LogUpperTail(int degrees, double x);
// parameters ln(rows), as the Bayesian information criterion has it.
double PenaltyOf(int parameters, const Candidate& candidate, const Evidence& evidence);

// Searches on the thinned rows where these are enough. Amplitudes outside of the record's bounds gain nothing. simpler:
// what a simpler record found on the same joints, if this one is tried after it; unknowns that both have start there.
Found SearchCandidate(Candidate& candidate, const Ground& ground, const Found* simpler = nullptr);
// The same on all rows.
Found Finish(const Found& rough, const Ground& ground);

}  // namespace armcal::diagnosis
