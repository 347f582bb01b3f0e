// diagnosis - the base rows of one pass on which candidates are tried, whole and thinned; one set more for each friction
// law that a candidate takes the place of.
#pragma once

#include <map>

#include "host_sim/diagnosis/work.hpp"

namespace armcal::diagnosis {

class Grounds {
 public:
  // Fits the base with the given terms and takes its residuals' spread as white noise.
  Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms);

  Ground Of(const Candidate& candidate) const;
  const BaseRows& RowsOf(const Candidate& candidate) const { return At(candidate).rows(); }
  // Deviance of these joints with no further column.
  double DevianceWithout(const std::vector<int>& joints) const;

 private:
  struct Place {
    BaseRows own, thin_rows;  // own: empty where the work's rows serve
    const BaseRows* all = nullptr;
    std::unique_ptr<Metric> metric, thin_metric;
    double cost = 0;
    const BaseRows& rows() const { return *all; }
  };
  const Place& At(const Candidate& candidate) const;

  Diagnosis::Work& work_;
  std::unique_ptr<Thinned> thinned_;
  mutable std::map<std::pair<std::string, int>, std::unique_ptr<Place>> place_;  // (law, joint); ("", -1): all of the base
  mutable std::map<std::vector<int>, double> without_;
};

}  // namespace armcal::diagnosis
