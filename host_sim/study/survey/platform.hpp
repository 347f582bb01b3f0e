// survey - the simulation platform of Figure 3: what is "measured" on a trajectory, in three tiers; knows no method.
//
// Tier 1: q, qd, qdd exact (Tables 5 to 9). Tier 2: noisy q, differentiated, with or without the 20 Hz filter. Tier 3:
// the closed loop at 1 kHz with an encoder; it comes from calibration's simulation of the control law.
#pragma once

#include <cstdint>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/excitation/series.hpp"

namespace armcal::survey {

inline constexpr double kRate_Hz = 100;
inline constexpr int kSamples = 1000;

// (27) sampled at 100 Hz from t = 0.
codegen::Signals Sampled(const excitation::Series& series, int samples = kSamples);

// White Gaussian noise, [samples x sigma.size()].
Eigen::MatrixXd Noise(int samples, const Eigen::VectorXd& sigma, std::uint64_t seed);

// A log all of whose rows may be used.
calibration::Dataset Measured(const codegen::Signals& s, const Eigen::MatrixXd& tau);

// Tier 2: q with noise of `noise_rad`, qd and qdd by central differences of it (one-sided at the ends).
codegen::Signals Differentiated(const codegen::Signals& s, double noise_rad, std::uint64_t seed);
// Central differences of a position that is there already.
codegen::Signals Differentiated(const Eigen::VectorXd& t, const Eigen::MatrixXd& q);
// q through the survey's 20 Hz Butterworth of order four, forward and backward, then central differences.
codegen::Signals Filtered(const Eigen::VectorXd& t, const Eigen::MatrixXd& q, double cutoff_Hz = 20);

}  // namespace armcal::survey
