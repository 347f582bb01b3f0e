// methods - (19), the Kalman filter as the survey prints it: zero start, P0 = 100 I, R = I.
#include "host_sim/identify/methods/classic_methods.hpp"
#include "host_sim/identify/methods/minimum_norm.hpp"
#include "host_sim/identify/methods/online_filter.hpp"

namespace armcal::calibration {

Solution Kalman(const Problem& problem) {
  ExpectLinear(problem, "Kalman filter");
  return RunOnline(problem, 1);
}

}  // namespace armcal::calibration
