// survey - the simulation platform: the trajectories of Figure 2, and what is "measured" along them (Figure 3).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/series.hpp"
#include "host_sim/study/survey/arm.hpp"

namespace armcal::survey {

inline constexpr double kRate_Hz = 100;
inline constexpr int kSamples = 1000;

// (27) sampled at 100 Hz from t = 0.
codegen::Signals Sampled(const excitation::Series& series, int samples = kSamples);

// White Gaussian noise, [samples x sigma.size()].
Eigen::MatrixXd Noise(int samples, const Eigen::VectorXd& sigma, std::uint64_t seed);

// A log of which all rows may be used.
calibration::Dataset Measured(const codegen::Signals& s, const Eigen::MatrixXd& tau);

// Tier 2: q with noise of `noise_rad`, qd and qdd by central differences of it (one-sided at the ends).
codegen::Signals Differentiated(const codegen::Signals& s, double noise_rad, std::uint64_t seed);
// Central differences of a given position.
codegen::Signals Differentiated(const Eigen::VectorXd& t, const Eigen::MatrixXd& q);
// q through the survey's 20 Hz Butterworth of order four, forward and backward, then central differences.
codegen::Signals Filtered(const Eigen::VectorXd& t, const Eigen::MatrixXd& q, double cutoff_Hz = 20);

// What to search, and the result.
struct ExcitedBy {
  Law law = Law::kCoulombViscous;  // kCoulombViscous (48 columns) or kGradient (60 columns)
  excitation::Family family = excitation::Family::kFourier;
  excitation::Search search = excitation::Search::kGradient;
  excitation::Criterion::Kind criterion = excitation::Criterion::Kind::kCondition;  // kAccuracy: of friction

  excitation::Series series;
  int columns = 0;         // of K: base parameters and friction
  double condition = 0;    // rows divided by sigma, columns scaled to unit norm
  double raw = 0;          // rows divided by sigma, columns as they are
  double unweighted = 0;   // rows as they are, columns scaled to unit norm
  double plain = 0;        // rows and columns as they are, SI units
  double all_sd = 0;       // the D-optimal figure: geometric mean over all of K's axes, units of the columns
  double friction_sd = 0;  // geometric mean of the standard deviations of friction's columns
  double share = 0;        // the largest share of any position, speed, acceleration or torque limit on a 1 ms grid
  double seconds = 0;      // the search took
  int searches = 0;
};

struct SearchSettings {
  double seconds = 55;  // at most; the number of starts is fixed, so given enough time the seed decides the result
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;
  int starts = 0;  // at most; 0: as many as the search has
};

// Searches ten coefficients a joint (Fourier: L = 5), period 10 s, with an offset. Fills in the result.
void Excite(const codegen::Robot& file, const codegen::Catalogue& records, const SearchSettings& settings,
            ExcitedBy& excited);

// Fills in the figures of excited.series.
void Examine(const codegen::Robot& file, const codegen::Catalogue& records, ExcitedBy& excited);

// A trajectory for validation, to which nothing is fitted: a random series within the limits.
excitation::Series Validation(const codegen::Robot& file, const codegen::Catalogue& records, std::uint64_t seed);

}  // namespace armcal::survey
