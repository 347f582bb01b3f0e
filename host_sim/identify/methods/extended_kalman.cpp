// methods - (21), the extended Kalman filter as the survey prints it, with tau_j for its tau_f and P_n for
// its P_k. On a linear model it is (19).
#include "host_sim/identify/methods/classic_methods.hpp"
#include "host_sim/identify/methods/online_filter.hpp"

namespace armcal::calibration {

Solution ExtendedKalman(const Problem& problem) { return RunOnline(problem, 1); }

}  // namespace armcal::calibration
