// search - limited-memory BFGS, and pagmo's simple genetic algorithm. No other file includes pagmo.
#include "host_sim/identify/search/minimise.hpp"
#include <algorithm>
#include <cmath>
#include <deque>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <utility>

namespace armcal::search {

namespace {

constexpr std::size_t kMemory = 12;   // pairs kept
constexpr int kWindow = 20;           // steps; too small a gain over them ends the search
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
      pairs.clear();  // a kink: starts again along the steepest descent
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

namespace {

constexpr unsigned kSlice = 10;  // generations between two looks at `stop`
constexpr double kCrossover = 0.9, kCrossoverIndex = 10, kMutationIndex = 20;
constexpr double kWorst = 1e300;  // pagmo compares values: infinities would be equal and NaN sorted anywhere

struct Fitness {
  const std::function<double(const Eigen::VectorXd&)>* value = nullptr;
  std::size_t size = 1;

  pagmo::vector_double fitness(const pagmo::vector_double& genome) const {
    const double v = (*value)(Eigen::Map<const Eigen::VectorXd>(genome.data(), static_cast<Eigen::Index>(size)));
    return {v < kWorst ? v : kWorst};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(size, 0.0), pagmo::vector_double(size, 1.0)};
  }
};

}  // namespace

GeneticResult MinimiseGenetic(const std::function<double(const Eigen::VectorXd& x)>& value, int size,
                              const GeneticSettings& settings) {
  const auto seed = static_cast<unsigned>(settings.seed ^ (settings.seed >> 32));
  const pagmo::algorithm algorithm(pagmo::sga(kSlice, kCrossover, kCrossoverIndex, 1.0 / size, kMutationIndex, 2, "sbx",
                                              "polynomial", "tournament", seed));
  pagmo::population population(pagmo::problem(Fitness{&value, static_cast<std::size_t>(size)}), settings.individuals,
                               seed);
  GeneticResult out;
  double earlier = population.champion_f()[0];
  for (; out.generations < settings.generations && !(settings.stop && settings.stop()); out.generations += kSlice) {
    if (out.generations <= settings.generations * 9 / 10) earlier = population.champion_f()[0];
    population = algorithm.evolve(population);
    if (settings.progress)
      settings.progress(static_cast<double>(out.generations) / settings.generations, population.champion_f()[0]);
  }
  const pagmo::vector_double best = population.champion_x();
  out.x = Eigen::Map<const Eigen::VectorXd>(best.data(), static_cast<Eigen::Index>(best.size()));
  out.value = population.champion_f()[0];
  out.last_tenth_gain = earlier > 0 ? 1 - out.value / earlier : 0;
  return out;
}

}  // namespace armcal::search
