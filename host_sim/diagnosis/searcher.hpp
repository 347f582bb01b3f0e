// diagnosis - one candidate's search: what every way of searching shares; used by search*.cpp only.
#pragma once

#include <functional>

#include "host_sim/diagnosis/search.hpp"

namespace armcal::diagnosis {

class Searcher {
 public:
  Searcher(Candidate& candidate, const Ground& ground, const Found* simpler);
  Found Run();

 private:
  // Keeps the point if it is the best so far; its gain.
  double Consider(const std::vector<double>& eta);
  double ConsiderThinned(const std::vector<double>& eta) const;
  // Amplitudes held, or out of bounds, are counted. A law that could take the declared one's place may stand beside it,
  // as two frictions in one joint do, but not against it.
  Gain Value(const Metric& metric, const Projection& projection) const;
  // What the column gains at its record's own amplitude: the parabola about the best one.
  void HoldAmplitude(Gain& g) const;
  bool AmplitudesInBounds(const Gain& gain) const;

  Found Scored() const;
  // The gain that a score of zero takes.
  double Needed(int rank) const;
  // Half of that: what a refinement may still bring.
  bool Promising() const { return best_.gain.gain > 0.5 * Needed(best_.gain.rank); }

  double FromUnit(int k, double u) const;
  double ToUnit(int k, double v) const;
  using Evaluator = std::function<double(const std::vector<double>&)>;
  // Pattern search in unit coordinates from eta: steps while that helps, then halves them. Returns where it ends.
  std::vector<double> Refine(std::vector<double> eta, double step, int rounds, const Evaluator& evaluate) const;
  void RefineBest(double step, int rounds);

  void Profile();   // search.cpp
  void Spectral();  // search_signal.cpp
  void Spline();    // search_signal.cpp
  void Onset();     // search_time.cpp
  void Windows();   // search_time.cpp

  Candidate& c_;
  const Found* simpler_;
  const Ground& g_;
  const Evidence& e_;
  Found best_;
  int searched_ = 0;
};

// A signal of the candidate's joint j ("q", "abs(qd)") or of its other one ("q[k]") in the rows of joint j.
Eigen::VectorXd OwnSignal(const Candidate& candidate, const Evidence& evidence, std::string name);

}  // namespace armcal::diagnosis
