// methods - declares every identification method. method.cpp puts them into the list that users choose from.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// Each throws io::InputError, one line, where the problem lacks what it needs.

// Those of the survey's section 3, in the survey's own form.
Solution PseudoInverse(const Problem& problem);          // (15): least squares of smallest norm
Solution WeightedPseudoInverse(const Problem& problem);  // (15) with rows over sigma_j
Solution Kalman(const Problem& problem);                 // (19); linear, online
Solution ExtendedKalman(const Problem& problem);         // (21); online
Solution Forgetting(const Problem& problem);             // (23), (24) with Problem::forgetting; online
Solution GradientDescent(const Problem& problem);        // (25) along its gradient from Problem::start
Solution Genetic(const Problem& problem);                // (25) by a genetic algorithm within the ranges
Solution ParticleFilter(const Problem& problem);         // (25) by particles within the ranges

// Those that do better.
Solution MapBarrier(const Problem& problem);          // maximum a posteriori, bodies kept physical; any model
Solution VariableProjection(const Problem& problem);  // nonlinear laws: eta outside, the linear part solved inside
Solution LogEkf(const Problem& problem);              // iterated EKF, (21) with Fs - Fc and q_s as logarithms; online
Solution StribeckBasis(const Problem& problem);       // (4) by a fixed linear basis and a read-out
Solution MultipleModel(const Problem& problem);       // three Kalman filters for friction that changes; online, linear
Solution InstrumentalVariable(const Problem& problem);  // (17), (18), regularised by the prior where there is one
Solution Didim(const Problem& problem);                 // output error on torque by simulation of the closed loop
Solution Robust(const Problem& problem);                // Huber, then bisquare weights; outliers
Solution FourierFitted(const Problem& problem);         // motion as its Fourier series, then MAP or weighted (15)
Solution ParallelDecimation(const Problem& problem);    // torque and columns through one low-pass, then every m-th row

// The recursion behind Kalman, ExtendedKalman and Forgetting; online_filter.cpp has its equations. It starts from the
// survey's covariance P = kStartVariance I, or from another one.
inline constexpr double kStartVariance = 100;  // squared units of each parameter
Solution RunOnline(const Problem& problem, double forgetting, double start_variance = kStartVariance);

}  // namespace armcal::calibration
