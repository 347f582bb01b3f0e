// methods - intervals of a nonlinear law by the profile of its cost.
#pragma once

#include "host_sim/identify/methods/projection.hpp"

namespace armcal::calibration {

// [z x 2] ends of the 95 % intervals at the minimum z, whose covariance [z x z] is given. An eta, or a linear parameter
// that only one joint's rows read beside an eta, is set to a value and all others are fitted again. The interval ends
// where that costs 1.92 more, in units of chi^2 / 2. So it may be one-sided (an end is infinite) and need not be
// symmetric. All other coordinates get +- 1.96 standard deviations, and so do laws with memory or that read the
// estimate. better: z; or, if the scan for other minima finds a lower one, its eta. Then fit again from there; the
// intervals are not complete.
Eigen::MatrixXd ProfileIntervals(const Projection& fit, const Eigen::VectorXd& z, const Eigen::MatrixXd& covariance,
                                 Eigen::VectorXd& better);

}  // namespace armcal::calibration
