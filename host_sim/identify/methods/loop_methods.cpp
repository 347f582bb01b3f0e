// methods - the two methods that simulate the closed loop: IDIM-IV, (17), and DIDIM.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>

#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSettledChange = 0.02;  // standard deviations: the simulations say nothing new

// What a reader must know of the share that the last round used; empty if it was 1.
std::string ShareRemark(double share) {
  return share == 1 ? ""
                    : "simulated at " + std::to_string(static_cast<int>(100 * share)) +
                          " % of the way from the start to the estimate, whose own arm runs away";
}

// Largest change of a coordinate in its standard deviations.
double LargestChange(const VectorXd& before, const VectorXd& after, const Eigen::MatrixXd& covariance) {
  double change = 0;
  for (Eigen::Index c = 0; c < before.size(); ++c)
    if (covariance(c, c) > 0) change = std::max(change, std::abs(after[c] - before[c]) / std::sqrt(covariance(c, c)));
  return change;
}

// One round of a method: from the simulated logs at z to the next z, and its covariance.
using LoopRound =
    std::function<Eigen::VectorXd(const std::vector<Dataset>& simulated, const Eigen::VectorXd& z, Solution& solution)>;

// Simulates and takes a round until no coordinate changes by more than a fiftieth of its standard deviation.
Solution IterateOnLoop(const Problem& problem, const char* method, int most, const LoopRound& round) {
  const double began = CpuSeconds();
  LoopLogs simulation(problem, method);
  Solution solution;
  // The first simulation is the start's: least squares may be so biased that its arm cannot be simulated.
  VectorXd z = problem.start;
  ClampEta(problem, z);
  solution.converged = false;
  for (; solution.iterations < most && !solution.converged && !Stopped(problem); ++solution.iterations) {
    solution.remark = ShareRemark(simulation.Simulate(z));
    VectorXd next = round(simulation.logs(), z, solution);
    ClampEta(problem, next);
    const double change = LargestChange(z, next, solution.covariance);
    solution.converged = change < kSettledChange;
    z = next;
    if (problem.progress) problem.progress(static_cast<double>(solution.iterations + 1) / most, change);
  }
  solution.z = z;
  if (!solution.converged && solution.remark.empty())
    solution.remark = "still moving after " + std::to_string(solution.iterations) + " simulations";
  Finish(problem, began, solution);
  return solution;
}

constexpr int kLoopRounds = 8;    // three are usual
constexpr double kUnseen = 1e-9;  // singular value, relative, of directions that (17) cannot see

// The step from z, and the covariance of the estimate behind it.
VectorXd Step(const Problem& problem, const VectorXd& z, const Linearised& K, const Linearised& Z,
              MatrixXd& covariance) {
  MatrixXd L;
  if (problem.covariance.size() > 0) {
    L = PriorFactor(problem);
  } else {  // free coordinates, columns of unit norm
    const std::vector<int> free = FreeCoordinates(problem);
    L = MatrixXd::Zero(z.size(), static_cast<Eigen::Index>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i) {
      const double norm = Z.A.col(free[i]).norm();
      L(free[i], static_cast<Eigen::Index>(i)) = norm > 0 ? 1 / norm : 0;
    }
  }
  const MatrixXd ZL = Z.A * L;
  MatrixXd M = ZL.transpose() * (K.A * L);
  const VectorXd target = K.residual + K.A * (z - problem.start);  // tau - K z0, whitened
  const VectorXd right = ZL.transpose() * target;
  const MatrixXd spread = ZL.transpose() * ZL;
  MatrixXd inverse;
  if (problem.covariance.size() > 0) {
    M.diagonal().array() += 1;
    inverse = M.partialPivLu().inverse();
    // w errs by M^-1 (Z' noise + prior): covariance M^-1 (Z'Z + 1) M^-T.
    const MatrixXd middle = spread + MatrixXd::Identity(M.rows(), M.cols());
    covariance = L * (inverse * middle * inverse.transpose()) * L.transpose();
  } else {
    const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const VectorXd s = svd.singularValues();
    VectorXd reciprocal(s.size());
    for (Eigen::Index k = 0; k < s.size(); ++k) reciprocal[k] = s[k] > kUnseen * s[0] ? 1 / s[k] : 0;
    inverse = svd.matrixV() * reciprocal.asDiagonal() * svd.matrixU().transpose();
    covariance = L * (inverse * spread * inverse.transpose()) * L.transpose();
  }
  return problem.start + L * (inverse * right);
}

}  // namespace

Solution InstrumentalVariable(const Problem& problem) {
  return IterateOnLoop(problem, "instrumental_variable", kLoopRounds,
                       [&](const std::vector<Dataset>& simulated, const VectorXd& z, Solution& solution) {
                         const Linearised measured = Linearise(problem, z);
                         solution.memory_bytes = 4 * static_cast<std::size_t>(measured.A.size()) * sizeof(double);
                         return Step(problem, z, measured, Linearise(Along(problem, simulated), z),
                                     solution.covariance);
                       });
}

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
