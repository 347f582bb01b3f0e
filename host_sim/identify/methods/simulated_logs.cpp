// methods - logs along the simulated motion, and when simulating again is no use; knows no single method.
#include "host_sim/identify/methods/simulated_logs.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/linearised.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

namespace {

constexpr double kFollows = 0.1;
constexpr double kSmallestShare = 0.125;

bool Follows(const codegen::Signals& s, const codegen::Signals& path) {
  for (Eigen::Index j = 0; j < path.q.cols(); ++j) {
    const auto motion = path.q.col(j).array() - path.q.col(j).mean();
    if ((s.q.col(j) - path.q.col(j)).squaredNorm() > kFollows * kFollows * motion.square().sum()) return false;
  }
  return true;
}

}  // namespace

LoopLogs::LoopLogs(const Problem& problem, const char* method) : problem_(problem) {
  if (!problem.closed_loop)
    throw io::InputError(std::string("method ") + method +
                         ": expected a control law in the robot file and a log with qref");
  if (!Run(problem.start))
    throw io::InputError(std::string("method ") + method +
                         ": the arm with the robot file's values runs away in simulation; expected gains and values "
                         "with which it follows its reference");
  start_ = logs_;
}

bool LoopLogs::Run(const VectorXd& z) {
  logs_.clear();
  for (const Dataset* log : problem_.train) {
    Dataset copy = *log;
    copy.s = problem_.closed_loop(*log, z);
    copy.s.temp = log->s.temp;
    if (!copy.s.q.allFinite() || !copy.s.qd.allFinite() || !copy.s.qdd.allFinite()) return false;
    if (!start_.empty() && !Follows(copy.s, start_[logs_.size()].s)) return false;
    logs_.push_back(std::move(copy));
  }
  return true;
}

double LoopLogs::Simulate(const VectorXd& z) {
  for (; share_ >= kSmallestShare; share_ /= 2)
    if (Run(problem_.start + share_ * (z - problem_.start))) return share_;
  logs_ = start_;
  return share_ = 0;
}

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

}  // namespace

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

}  // namespace armcal::calibration
