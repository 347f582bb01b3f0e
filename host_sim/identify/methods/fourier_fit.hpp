// methods - periodic motion as a Fourier series: position without noise, derivatives without
// differentiation; knows no method.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

inline constexpr int kFourierHarmonics = 15;  // (27) has 5; an arm that follows it adds some

// The log with q, qd, qdd of the least-squares series offset + sum_{h = 1 .. harmonics} of period_s; rows whose joint
// then moves slower than v_min are not used any more. Torque stays as it is. Use before any method, where the
// excitation is periodic. InputError: fewer samples than coefficients, or a period beyond the log's length.
Dataset FourierFit(const codegen::Model& model, const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// Root mean square of q minus the series, per joint.
Eigen::VectorXd FourierResidual(const Dataset& log, double period_s, int harmonics = kFourierHarmonics);

// The period of a log that holds a whole number of them: of length / k, k = 1 .. length / 1 s, the one that fits best.
double FindPeriod_s(const Dataset& log, int harmonics = kFourierHarmonics);

}  // namespace armcal::calibration
