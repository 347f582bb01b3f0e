// methods - those of the survey's section 3, in its own form; each in the file of its name.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// Each throws io::InputError, one line, where the problem lacks what it needs.
Solution PseudoInverse(const Problem& problem);          // (15): least squares of smallest norm
Solution WeightedPseudoInverse(const Problem& problem);  // (15) with rows over sigma_j
Solution Kalman(const Problem& problem);                 // (19); linear, online
Solution ExtendedKalman(const Problem& problem);         // (21); online
Solution Forgetting(const Problem& problem);             // (23), (24) with Problem::forgetting; online
Solution GradientDescent(const Problem& problem);        // (25) along its gradient from Problem::start
Solution Genetic(const Problem& problem);                // (25) by a genetic algorithm within the ranges
Solution ParticleFilter(const Problem& problem);         // (25) by particles within the ranges

}  // namespace armcal::calibration
