// calibration methods - (25) by pagmo's simple genetic algorithm: tournament, simulated binary crossover, polynomial
// mutation, the best of parents and children live on. The only file that sees pagmo.
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include <utility>

#include "host_sim/calibration/methods/classic_methods.hpp"
#include "host_sim/calibration/methods/linearised.hpp"
#include "host_sim/calibration/methods/objective.hpp"
#include "host_sim/calibration/methods/search_space.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {

constexpr unsigned kIndividuals = 100;
constexpr unsigned kSlice = 10;  // generations between two looks at `stop`
constexpr int kLinear = 3000;    // generations; a value of a linear model takes some microseconds,
constexpr int kNonlinear = 500;  // one of a nonlinear model a good part of a millisecond
constexpr double kCrossover = 0.9, kCrossoverIndex = 10, kMutationIndex = 20;

// What pagmo minimises over [0, 1]^n. A genome stands for the nearest possible bodies on the way to the start.
struct Fitness {
  Objective* objective = nullptr;
  const SearchSpace* space = nullptr;

  VectorXd Point(const pagmo::vector_double& genome) const {
    const Eigen::Map<const VectorXd> u(genome.data(), static_cast<Eigen::Index>(genome.size()));
    return space->Possible(space->Point(u));
  }
  pagmo::vector_double fitness(const pagmo::vector_double& genome) const { return {(*objective)(Point(genome))}; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    const auto size = static_cast<std::size_t>(space ? space->size() : 1);
    return {pagmo::vector_double(size, 0.0), pagmo::vector_double(size, 1.0)};
  }
};

}  // namespace

Solution Genetic(const Problem& problem) {
  const double began = CpuSeconds();
  const SearchSpace space(problem, "genetic algorithm");
  Objective objective(problem, Criterion::kMeanSpread);
  const Fitness fitness{&objective, &space};
  const int generations = problem.model->nonlinear() ? kNonlinear : kLinear;
  const auto seed = static_cast<unsigned>(problem.seed ^ (problem.seed >> 32));
  const pagmo::algorithm algorithm(pagmo::sga(kSlice, kCrossover, kCrossoverIndex, 1.0 / space.size(), kMutationIndex,
                                              2, "sbx", "polynomial", "tournament", seed));
  pagmo::population population(pagmo::problem(fitness), kIndividuals, seed);
  Solution out;
  double earlier = population.champion_f()[0];
  for (; out.iterations < generations && !Stopped(problem); out.iterations += kSlice) {
    if (out.iterations == generations * 9 / 10) earlier = population.champion_f()[0];
    population = algorithm.evolve(population);
    if (problem.progress)
      problem.progress(static_cast<double>(out.iterations) / generations, population.champion_f()[0]);
  }
  // The last tenth gained nearly nothing.
  out.converged = out.iterations >= generations && population.champion_f()[0] > 0.99 * earlier;
  out.z = fitness.Point(population.champion_x());
  out.bodies = space.Bodies(out.z);
  out.memory_bytes =
      objective.memory_bytes() + 2 * sizeof(double) * kIndividuals * static_cast<std::size_t>(space.size());
  out.remark = space.AtEnds(out.z);
  Finish(problem, began, out);
  return out;
}

}  // namespace armcal::calibration
