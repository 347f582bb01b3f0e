// search - unconstrained minimisation by limited-memory BFGS; knows nothing of what is minimised.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace armcal::search {

// Value at x, and its gradient. May return infinity where x is out of the function's domain.
using Differentiable = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct MinimiseSettings {
  int iterations = 300;
  double tolerance = 1e-5;     // stop when a window of 20 steps gains less than this
  std::function<bool()> stop;  // asked before every step
};

// Improves x in place, never to a worse value; returns the value. Nocedal & Wright, Numerical Optimization,
// algorithm 7.5, with backtracking: a pair whose curvature is not positive is left out.
double Minimise(const Differentiable& function, const MinimiseSettings& settings, Eigen::VectorXd& x);

}  // namespace armcal::search
