// methods - minimises (25) by a genetic algorithm, within the ranges and among bodies that can exist.
#include "host_sim/identify/search/minimise.hpp"

#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/search_problem.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {

constexpr int kLinear = 3000;    // generations; one value takes some microseconds
constexpr int kNonlinear = 500;  // generations; one value takes a good part of a millisecond

}  // namespace

Solution Genetic(const Problem& problem) {
  const double began = CpuSeconds();
  const SearchSpace space(problem, "genetic algorithm");
  Objective objective(problem, Criterion::kMeanSpread);
  // A genome whose bodies cannot exist is moved towards the start until they can.
  const auto point = [&](const VectorXd& u) { return space.Possible(space.Point(u)); };
  search::GeneticSettings settings;
  settings.generations = problem.model->nonlinear() ? kNonlinear : kLinear;
  settings.seed = problem.seed;
  settings.stop = [&] { return Stopped(problem); };
  settings.progress = problem.progress;
  const search::GeneticResult best =
      search::MinimiseGenetic([&](const VectorXd& u) { return objective(point(u)); }, space.size(), settings);
  Solution out;
  out.iterations = best.generations;
  out.converged = best.generations >= settings.generations && best.last_tenth_gain < 0.01;
  out.z = point(best.x);
  out.bodies = space.Bodies(out.z);
  out.memory_bytes =
      objective.memory_bytes() + 2 * sizeof(double) * settings.individuals * static_cast<std::size_t>(space.size());
  out.remark = space.AtEnds(out.z);
  Finish(problem, began, out);
  return out;
}

}  // namespace armcal::calibration
