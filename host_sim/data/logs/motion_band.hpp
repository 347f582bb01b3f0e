// logs - how high a sampled position still moves; knows no joint and no filter.
#pragma once

#include <Eigen/Core>

namespace armcal::logs {

// The frequency [Hz] above which evenly sampled q shows less power than white noise of this standard deviation would.
// Welch's periodogram of the second difference. 0 if q only holds noise;
// half the rate if it is too short to tell.
double MotionBand_Hz(const Eigen::VectorXd& q, double noise, double rate_Hz);

}  // namespace armcal::logs
