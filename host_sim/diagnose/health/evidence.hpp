// health - from a drive's bins to means with their noise; knows no cause.
#pragma once

#include <vector>

#include "host_sim/client/residual_reader.hpp"
#include "host_sim/diagnose/health/shapes.hpp"

namespace armcal::health {

// Over all rows of a set.
struct Overall {
  double rows = 0, mean_square = 0;
};
Overall OverallOf(const client::ResidualBins& bins);

// Of the first rows after the adoption: the residual itself.
std::vector<Evidence> ReferenceEvidence(const client::JointResiduals& joint);

// Latest minus first rows, bin by bin: a misfit that was there from the start cancels. Where a bin's rows moved in the
// meantime (another program, a warmer joint), the difference that the shapes fitted to the first rows make is taken
// out.
std::vector<Evidence> ChangeEvidence(const client::JointResiduals& joint);

}  // namespace armcal::health
