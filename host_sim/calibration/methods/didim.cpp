// calibration methods - DIDIM: the torque of the simulated closed loop is fitted to the measured one; knows no truth.
//
// Gautier, Janot, Vandanjon 2013. Under its control law the simulated arm follows the same path whatever its
// parameters, so d tau_sim / d z is K along the simulated motion: each round is least squares of the measured torque on
// it. Measured positions are not used at all, so neither their noise nor their differentiation matters.
#include <cmath>

#include "host_sim/calibration/methods/better_methods.hpp"
#include "host_sim/calibration/methods/linearised.hpp"
#include "host_sim/io/input_error.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {
constexpr int kIterations = 10;
constexpr double kSettled = 0.02;  // largest change of a coordinate in its standard deviations
}  // namespace

Solution Didim(const Problem& problem) {
  const double began = CpuSeconds();
  if (!problem.closed_loop)
    throw io::InputError("method didim: expected a control law in the robot file and a log with qref");
  Solution solution;
  VectorXd z = problem.start;
  ClampEta(problem, z);
  solution.converged = false;
  for (; solution.iterations < kIterations && !solution.converged && !Stopped(problem); ++solution.iterations) {
    std::vector<Dataset> simulated;
    bool complete = true;
    for (const Dataset* log : problem.train) {
      Dataset copy = *log;
      copy.s = problem.closed_loop(*log, z);
      copy.s.temp = log->s.temp;
      complete = complete && copy.s.q.allFinite() && copy.s.qd.allFinite() && copy.s.qdd.allFinite();
      simulated.push_back(std::move(copy));
    }
    if (!complete) {
      solution.remark = "the simulated arm runs away at iteration " + std::to_string(solution.iterations + 1);
      break;
    }
    Problem along = problem;
    along.train.clear();
    for (const Dataset& log : simulated) along.train.push_back(&log);
    const Linearised sim = Linearise(along, z);
    VectorXd next = SolveRegularised(problem, sim.A.transpose() * sim.A, sim.A.transpose() * (sim.residual + sim.A * z),
                                     &solution.covariance);
    ClampEta(problem, next);
    double change = 0;
    for (Eigen::Index c = 0; c < z.size(); ++c)
      if (solution.covariance(c, c) > 0)
        change = std::max(change, std::abs(next[c] - z[c]) / std::sqrt(solution.covariance(c, c)));
    solution.converged = change < kSettled;
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
