// judged set - adds torque noise and encoder steps.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host_sim/machine/plant/random.hpp"

namespace armcal::judged {

// "white", "coloured", "heavy_tailed", "resonant", "coarse_encoder", "quiet": those of set I. Set II also knows "slow"
// and "very_quiet".
const std::vector<std::string>& NoiseClasses();

// Of standard deviation `sigma` at each sample; quiet: a tenth of it; very_quiet: a fiftieth; slow: an autoregression
// with a pole of .974 to .990 at 250 Hz, and white noise.
Eigen::VectorXd DrawNoise(const std::string& noise_class, int samples, double sigma, double rate_Hz,
                          plant::Random& random);
// Counts per motor turn.
double EncoderCounts(const std::string& noise_class);

}  // namespace armcal::judged
