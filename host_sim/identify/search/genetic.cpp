// search - the only file that sees pagmo.
#include "host_sim/identify/search/genetic.hpp"

#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include <algorithm>
#include <utility>

namespace armcal::search {
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
