// diagnosis - says how much a further log speaks for a term. For this room only.
#pragma once

#include "host_sim/diagnose/diagnosis/work.hpp"

namespace armcal::diagnosis {

// How much more likely the log is with the term than without it, twice the logarithm, over the term's joints.
// without, with: [samples x joints] what the model leaves of the log. The largest of four figures: with white noise,
// and with noise of the colour of what is left; with all of the residuals, and with residuals cut at four deviations.
// What the base model does not predict of another motion is slow, and whitening takes slow terms for it. A few knocks
// on the log would hide what the term gains in all other rows.
double GainOn(const calibration::Dataset& log, const Candidate& candidate, const Eigen::MatrixXd& without,
              const Eigen::MatrixXd& with);

// What the log adds to the term's gain beside the others, if the declared model and all amplitudes are fitted to the
// training logs and this one together. A model that is a little wrong of another motion may hide on it what a term
// gains. The larger of two figures: with white noise, and with noise of the colour of what is left in training.
double AddedBy(Diagnosis::Work& w, const calibration::Dataset& log, const Chosen& term,
               const std::vector<const Chosen*>& others);

}  // namespace armcal::diagnosis
