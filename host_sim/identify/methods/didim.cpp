// methods - DIDIM: the torque of the simulated closed loop is fitted to the measured one; knows no truth.
//
// Gautier, Janot, Vandanjon 2013. Under its control law the simulated arm follows the same path whatever its
// parameters, so d tau_sim / d z is K along the simulated motion: each round is least squares of the measured torque on
// it. Measured positions are not used at all, so neither their noise nor their differentiation matters.
#include "host_sim/identify/methods/better_methods.hpp"
#include "host_sim/identify/methods/linearised.hpp"
#include "host_sim/identify/methods/simulated_logs.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {
constexpr int kIterations = 10;
}  // namespace

Solution Didim(const Problem& problem) {
  return IterateOnLoop(problem, "didim", kIterations,
                       [&](const std::vector<Dataset>& simulated, const VectorXd& z, Solution& solution) {
                         const Linearised sim = Linearise(Along(problem, simulated), z);
                         solution.memory_bytes = 2 * static_cast<std::size_t>(sim.A.size()) * sizeof(double);
                         return SolveRegularised(problem, sim.A.transpose() * sim.A,
                                                 sim.A.transpose() * (sim.residual + sim.A * z), &solution.covariance);
                       });
}

}  // namespace armcal::calibration
