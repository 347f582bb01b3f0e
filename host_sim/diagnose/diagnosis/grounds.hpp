// diagnosis - what candidates of one pass are tried on: the base with the terms so far, whole and thinned.
#pragma once

#include <map>

#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

class Grounds {
 public:
  // Fits the base with the given terms and takes its residuals' spread as white noise. only: the one candidate that is
  // tried on it; null: any.
  Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms, const Candidate* only = nullptr);

  Ground ground() const { return {work_.evidence, *thinned_, *metric_, *thin_metric_}; }
  const Metric& metric() const { return *metric_; }
  // Deviance of these joints with no further column.
  double DevianceWithout(const std::vector<int>& joints) const;
  // Takes as noise what the fit with these columns leaves; true if it is clearly less.
  bool Sharpen(const Columns& with);

 private:
  void MakeMetrics(const std::vector<NoiseModel>& noise);

  Diagnosis::Work& work_;
  std::unique_ptr<Thinned> thinned_;
  BaseRows thin_rows_;
  std::unique_ptr<Metric> metric_, thin_metric_;
  mutable std::map<std::vector<int>, double> without_;
};

}  // namespace armcal::diagnosis
