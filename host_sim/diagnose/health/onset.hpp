// health - when a joint's residual grew: one step in its history; knows no cause.
#pragma once

#include <optional>
#include <vector>

#include "host_sim/client/residual_reader.hpp"

namespace armcal::health {

// Seconds since the adoption.
struct Onset {
  double at_s = 0;
  double earliest_s = 0, latest_s = 0;  // the two slices at the step
};

// The step of the mean square that is most likely under Gaussian residuals. Nothing: no slice, or the residual did not
// grow.
std::optional<Onset> FindOnset(const std::vector<client::ResidualSlice>& slices, double elapsed_s);

}  // namespace armcal::health
