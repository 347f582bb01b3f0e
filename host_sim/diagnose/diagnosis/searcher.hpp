// diagnosis - holds the state of one search. Only the files search*.cpp include this.
#pragma once

#include <functional>

#include "host_sim/diagnose/diagnosis/search.hpp"

namespace armcal::diagnosis {

class Searcher {
 public:
  Searcher(Candidate& candidate, const Ground& ground, const Found* simpler);
  Found Run();
  Found Finish(const Found& rough);

 private:
  // On the thinned rows while the search is rough.
  const Metric& metric() const { return best_.rough ? g_.thin_metric : g_.metric; }
  Columns Gather(const std::vector<double>& eta) const {
    return best_.rough ? g_.thinned.Gather(c_, eta) : GatherColumns(c_, e_, eta);
  }
  // Of all rows, also where the search is rough.
  Gain Try(const std::vector<double>& eta) const { return Value(metric().Project(Gather(eta))); }
  // Keeps the point if it is the best so far; its gain.
  double Consider(const std::vector<double>& eta);
  // The gain if held amplitudes keep their value; zero if an amplitude is out of bounds. A record that could replace
  // the declared friction law may stand beside it, but must not push that law's parameters out of their bounds.
  Gain Value(const Projection& projection) const;
  // What the column gains at its record's own amplitude: the parabola about the best one.
  void HoldAmplitude(Gain& g) const;
  bool AmplitudesInBounds(const Gain& gain) const;

  Found Scored() const;
  // The gain of so many amplitudes that chance gives no more often than this.
  double Needed(int rank) const;
  // A refinement may still reach that gain.
  bool Promising() const { return best_.gain.gain > (best_.rough ? 0.3 : 0.5) * Needed(best_.gain.rank); }

  double FromUnit(int k, double u) const;
  double ToUnit(int k, double v) const;
  using Evaluator = std::function<double(const std::vector<double>&)>;
  // Pattern search in unit coordinates from eta: steps while that helps, then halves them. Returns where it ends.
  std::vector<double> Refine(std::vector<double> eta, double step, int rounds, const Evaluator& evaluate) const;
  void RefineBest(double step, int rounds);
  // Gauss-Newton, unknowns in unit coordinates: a pattern search would creep along a valley.
  std::vector<double> Climb(std::vector<double> eta) const;
  static constexpr int kOnsetGrid = 12;     // cells of the log's time
  static constexpr int kOnsetHalvings = 7;  // of half a cell: a few hundredths of a second
  double GridStep() const { return 0.5 / (c_.record().search.grid - 1); }

  void Profile();   // search.cpp
  void Spectral();  // search_signal.cpp
  void Spline();    // search_signal.cpp
  void Surface();   // search_signal.cpp
  void Onset();     // search_time.cpp
  void Windows();   // search_time.cpp

  Candidate& c_;
  const Found* simpler_;
  const Ground& g_;
  const Evidence& e_;
  Found best_;
  Projection seen_;  // of the best
};

}  // namespace armcal::diagnosis
