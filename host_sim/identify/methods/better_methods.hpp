// methods - what beats the survey's methods, behind the same interface; each in the file of its name.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// Each throws io::InputError, one line, where the problem lacks what it needs.
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

}  // namespace armcal::calibration
