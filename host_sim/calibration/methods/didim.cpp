// calibration methods - DIDIM: the torque of the simulated closed loop is fitted to the measured one; knows no truth.
//
// Gautier, Janot, Vandanjon 2013. Under its control law the simulated arm follows the same path whatever its
// parameters, so d tau_sim / d z is K along the simulated motion: each round is least squares of the measured torque on
// it. Measured positions are not used at all, so neither their noise nor their differentiation matters.
#include "host_sim/calibration/methods/better_methods.hpp"
#include "host_sim/calibration/methods/linearised.hpp"
#include "host_sim/calibration/methods/simulated_logs.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {
constexpr int kIterations = 10;
}  // namespace

Solution Didim(const Problem& problem) {
  const double began = CpuSeconds();
  LoopLogs simulation(problem, "didim");
  Solution solution;
  VectorXd z = problem.start;
  ClampEta(problem, z);
  solution.converged = false;
  for (; solution.iterations < kIterations && !solution.converged && !Stopped(problem); ++solution.iterations) {
    solution.remark = ShareRemark(simulation.Simulate(z));
    const Linearised sim = Linearise(Along(problem, simulation.logs()), z);
    VectorXd next = SolveRegularised(problem, sim.A.transpose() * sim.A, sim.A.transpose() * (sim.residual + sim.A * z),
                                     &solution.covariance);
    ClampEta(problem, next);
    const double change = LargestChange(z, next, solution.covariance);
    solution.converged = change < kSettledChange;
    z = next;
    solution.memory_bytes = 2 * static_cast<std::size_t>(sim.A.size()) * sizeof(double);
    if (problem.progress) problem.progress(static_cast<double>(solution.iterations + 1) / kIterations, change);
  }
  solution.z = z;
  if (!solution.converged && solution.remark.empty())
    solution.remark = "still moving after " + std::to_string(solution.iterations) + " simulations";
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
