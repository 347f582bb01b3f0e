// logs - filters a sampled signal by a low-pass without phase.
#pragma once

#include <Eigen/Core>

namespace armcal::logs {

// Butterworth low-pass of order 4 run forward and backward: gain 1 / (1 + (f / cutoff)^8) (bilinear with prewarping),
// no phase. At both ends the signal is extended by its point reflection and the filter starts settled, so that a
// constant and a straight line pass unchanged. x: uniformly sampled; 0 < cutoff_Hz < rate_Hz / 2.
Eigen::VectorXd ZeroPhaseLowPass(const Eigen::VectorXd& x, double cutoff_Hz, double rate_Hz);

}  // namespace armcal::logs
