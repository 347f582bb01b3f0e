// calibration methods - logs along the simulated motion, and when simulating again is no use; knows no single method.
#include "host_sim/calibration/methods/simulated_logs.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/io/input_error.hpp"

namespace armcal::calibration {

using Eigen::VectorXd;

void RequireLoop(const Problem& problem, const char* method) {
  if (!problem.closed_loop)
    throw io::InputError(std::string("method ") + method +
                         ": expected a control law in the robot file and a log with qref");
}

bool SimulateLogs(const Problem& problem, const VectorXd& z, std::vector<Dataset>& simulated) {
  simulated.clear();
  for (const Dataset* log : problem.train) {
    Dataset copy = *log;
    copy.s = problem.closed_loop(*log, z);
    copy.s.temp = log->s.temp;
    if (!copy.s.q.allFinite() || !copy.s.qd.allFinite() || !copy.s.qdd.allFinite()) return false;
    simulated.push_back(std::move(copy));
  }
  return true;
}

Problem Along(const Problem& problem, const std::vector<Dataset>& logs) {
  Problem other = problem;
  other.train.clear();
  for (const Dataset& log : logs) other.train.push_back(&log);
  return other;
}

double LargestChange(const VectorXd& before, const VectorXd& after, const Eigen::MatrixXd& covariance) {
  double change = 0;
  for (Eigen::Index c = 0; c < before.size(); ++c)
    if (covariance(c, c) > 0) change = std::max(change, std::abs(after[c] - before[c]) / std::sqrt(covariance(c, c)));
  return change;
}

}  // namespace armcal::calibration
