// methods - the recursion that (19), (21), (23) and (24) share, in the survey's own form; knows no prior.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// With forgetting mu, sample after sample:
//   G = P K' (K P K' + mu I)^-1,  z += G (tau_j - prediction),  P = (I - G K) P / mu.
// mu = 1 is (19) and (21) with R = I; mu < 1 is (23) and (24). Linear models: prediction K p. Nonlinear ones:
// prediction K_d p_d + f(p_f), K = [K_d, d f / d p_f] taken at each sample's own estimate. The survey prints tau_f for
// tau_j and P_k for P_n in (21), (24). P is neither symmetrised nor bounded: what becomes of it is the survey's method.
//
// Start: p = 0, P = 100 I. Nonlinear parameters start at Problem::start: a Stribeck speed of zero divides by zero.
// Where their range is positive the law sees their magnitude, as in (4), and the magnitude is what comes out. path:
// every sample of every log, NaN after a divergence; a sample without used rows only ages P.
inline constexpr double kStartVariance = 100;  // of the survey, squared units of each parameter
Solution RunOnline(const Problem& problem, double forgetting, double start_variance = kStartVariance);

}  // namespace armcal::calibration
