// search - minimises a function of numbers, by its gradient or by a genetic algorithm.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace armcal::search {

// Value at x, and its gradient. May return infinity where x is out of the function's domain.
using Differentiable = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct MinimiseSettings {
  int iterations = 300;
  double tolerance = 1e-5;     // stop when a window of 20 steps gains less than this
  std::function<bool()> stop;  // asked before every step
};

// Limited-memory BFGS. Improves x in place and never makes it worse; returns the value. Nocedal & Wright, Numerical
// Optimization, algorithm 7.5, with backtracking. A pair whose curvature is not positive is left out.
double Minimise(const Differentiable& function, const MinimiseSettings& settings, Eigen::VectorXd& x);

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

// pagmo's simple genetic algorithm: tournament, simulated binary crossover, polynomial mutation; the best of parents
// and children live on. value: called by one thread; may return infinity.
GeneticResult MinimiseGenetic(const std::function<double(const Eigen::VectorXd& x)>& value, int size,
                              const GeneticSettings& settings);

}  // namespace armcal::search
