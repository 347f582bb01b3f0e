// calibration methods - what methods that simulate the closed loop share; knows no single method.
#pragma once

#include "host_sim/calibration/method.hpp"

namespace armcal::calibration {

// InputError naming the method where the problem has no closed loop.
void RequireLoop(const Problem& problem, const char* method);

// The training logs with their signals replaced by the simulated ones at z; false where the simulated arm runs away.
bool SimulateLogs(const Problem& problem, const Eigen::VectorXd& z, std::vector<Dataset>& simulated);

// The same problem along other logs, which must outlive it.
Problem Along(const Problem& problem, const std::vector<Dataset>& logs);

// Largest change of a coordinate in its standard deviations.
double LargestChange(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::MatrixXd& covariance);

inline constexpr double kSettledChange = 0.02;  // a LargestChange below it: the simulations say nothing new

}  // namespace armcal::calibration
