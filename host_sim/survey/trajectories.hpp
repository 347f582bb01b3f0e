// survey - the excitation trajectories of (26), (27) and Figure 2, and what their condition number means; knows no
// method.
#pragma once

#include <atomic>
#include <functional>

#include "host_sim/excitation/fourier.hpp"
#include "host_sim/survey/arm.hpp"

namespace armcal::survey {

struct ExcitedBy {
  excitation::Fourier series;
  std::string law;        // "(7)"
  int columns = 0;        // of K: base parameters and friction
  double condition = 0;   // rows divided by sigma, columns scaled to unit norm
  double raw = 0;         // rows divided by sigma, columns as they are
  double unweighted = 0;  // rows as they are, columns scaled to unit norm
  double share = 0;       // the largest share of any position, speed, acceleration or torque limit on a 1 ms grid
  double seconds = 0;     // the search took
  int searches = 0;
};

struct SearchSettings {
  double seconds = 25;
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;
};

// L = 5, w_f = 2 pi 0.1 rad/s, offset allowed. law: kCoulombViscous (48 columns) or kGradient (60 columns).
ExcitedBy Excite(const codegen::Robot& file, const codegen::Catalogue& records, Law law,
                 const SearchSettings& settings);

// The figures of `found` for a series from elsewhere.
ExcitedBy Examine(const codegen::Robot& file, const codegen::Catalogue& records, Law law,
                  const excitation::Fourier& series);

// A trajectory that nothing was fitted to: a random series within the limits.
excitation::Fourier Validation(const codegen::Robot& file, const codegen::Catalogue& records, std::uint64_t seed);

}  // namespace armcal::survey
