// search - limited-memory BFGS; knows nothing of what is minimised.
#include "host_sim/identify/search/minimise.hpp"

#include <cmath>
#include <deque>

namespace armcal::search {
namespace {

constexpr std::size_t kMemory = 12;   // pairs kept
constexpr int kWindow = 20;           // steps over which too small a gain means: done
constexpr double kSufficient = 1e-4;  // Armijo's constant

struct Pair {
  Eigen::VectorXd step, change;  // of x and of the gradient
  double inverse_curvature;
};

Eigen::VectorXd Direction(const std::deque<Pair>& pairs, const Eigen::VectorXd& gradient) {
  Eigen::VectorXd d = -gradient;
  std::vector<double> alpha(pairs.size());
  for (std::size_t k = pairs.size(); k-- > 0;) {
    alpha[k] = pairs[k].inverse_curvature * pairs[k].step.dot(d);
    d -= alpha[k] * pairs[k].change;
  }
  if (pairs.empty()) return d / std::max(1.0, d.norm());
  d /= pairs.back().inverse_curvature * pairs.back().change.squaredNorm();
  for (std::size_t k = 0; k < pairs.size(); ++k)
    d += (alpha[k] - pairs[k].inverse_curvature * pairs[k].change.dot(d)) * pairs[k].step;
  return d;
}

}  // namespace

double Minimise(const Differentiable& function, const MinimiseSettings& settings, Eigen::VectorXd& x) {
  Eigen::VectorXd gradient(x.size()), next_gradient(x.size()), next(x.size());
  double value = function(x, gradient);
  std::deque<Pair> pairs;
  std::deque<double> history;
  for (int k = 0; k < settings.iterations && !(settings.stop && settings.stop()); ++k) {
    Eigen::VectorXd direction = Direction(pairs, gradient);
    double slope = gradient.dot(direction);
    if (!(slope < 0)) {
      if (pairs.empty()) break;
      pairs.clear();
      direction = Direction(pairs, gradient);
      slope = gradient.dot(direction);
    }
    double length = 1, next_value = value;
    bool found = false;
    for (int halvings = 0; halvings < 25 && !found; ++halvings, length /= 2) {
      next = x + length * direction;
      next_value = function(next, next_gradient);
      found = std::isfinite(next_value) && next_value <= value + kSufficient * length * slope;
    }
    if (!found) {
      if (pairs.empty()) break;
      pairs.clear();  // a kink: start again along the steepest descent
      continue;
    }
    Pair pair{next - x, next_gradient - gradient, 0};
    const double curvature = pair.step.dot(pair.change);
    if (curvature > 1e-10 * pair.change.squaredNorm()) {
      pair.inverse_curvature = 1 / curvature;
      pairs.push_back(std::move(pair));
      if (pairs.size() > kMemory) pairs.pop_front();
    }
    x = next, gradient = next_gradient, value = next_value;
    history.push_back(value);
    if (history.size() > kWindow) {
      if (history.front() - value < settings.tolerance) break;
      history.pop_front();
    }
  }
  return value;
}

}  // namespace armcal::search
