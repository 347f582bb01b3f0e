// diagnosis - says which parameters of a term the logs determine, and leaves out a term that nobody could use.
#pragma once

#include <string>
#include <vector>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"

namespace armcal::diagnosis {

// A search that ends at a bound of an unknown stops this close to it. Such an unknown is held there, not estimated: its
// deviation is zero, and the others' are those without it.
bool IsAtEdge(const codegen::EffectUnknown& unknown, double value);

enum class Mark {
  kNone,
  kUndetermined,  // smaller than its own standard deviation (three, if the term has no amplitude), or without effect
  kOnBound,       // where its search ends, or beyond what its record allows
};

// A mark a parameter. The places of a curve's knots and the times of an event or a state of a run are no parameters:
// they have none.
struct Marks {
  std::vector<Mark> eta, amplitude;
  // The amplitudes together are larger than their covariance explains by chance, and a parameter at least is
  // determined. Coefficients of a form mean nothing one by one and have no marks; for it the first is enough.
  bool usable = true;
};
Marks MarkParameters(const Term& term);

// "r = 0.91 +- 45 1 is not determined; gap = 1e-05 +- 2e-07 rad is on its bound"; empty: none is marked.
std::string MarkText(const Term& term);

// Leaves out, the weakest first, the chosen terms that are not usable, and says why in their Chosen::unconfirmed.
void LeaveOutUndetermined(Diagnosis::Work& work, Finding& finding);

}  // namespace armcal::diagnosis
