// search - minimisation over the unit cube by pagmo's simple genetic algorithm; knows nothing of what is minimised.
// Tournament, simulated binary crossover, polynomial mutation, the best of parents and children live on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace armcal::search {

struct GeneticSettings {
  unsigned individuals = 100;
  int generations = 500;
  std::uint64_t seed = 1;
  std::function<bool()> stop;                                      // asked every ten generations
  std::function<void(double share_done, double best)> progress{};  // told every ten generations
};

struct GeneticResult {
  Eigen::VectorXd x;  // the best found, in [0, 1]^size
  double value = 0;
  int generations = 0;
  double last_tenth_gain = 0;  // share by which the last tenth of the generations lowered the value
};

// value: called by one thread; may return infinity.
GeneticResult MinimiseGenetic(const std::function<double(const Eigen::VectorXd& x)>& value, int size,
                              const GeneticSettings& settings);

}  // namespace armcal::search
