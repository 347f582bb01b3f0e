// diagnosis - says how large an effect of each kind would have had to be for these logs to show it.
#pragma once

#include "host_sim/diagnose/diagnosis/diagnose.hpp"

namespace armcal::diagnosis {

// One limit for each record and joint set that was tried and not chosen: a term of that size, put into the training
// logs, would just have been accepted by its score. The noise is what the final fit leaves, coloured as it is; what the
// declared model takes up of the term does not count. Smallest first within a joint. Events have none.
std::vector<Limit> DetectionLimits(Diagnosis::Work& work);

// [n] The median of the limits of each joint's own terms.
Eigen::VectorXd TypicalLimits(const std::vector<Limit>& limits, int joints);

}  // namespace armcal::diagnosis
