// survey - the excitation trajectories of (26), (27) and Figure 2, and what their condition number means; knows no
// method.
#pragma once

#include <atomic>
#include <functional>

#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/study/survey/arm.hpp"

namespace armcal::survey {

// What to search, and what came out.
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
  double all_sd = 0;       // the D-optimal figure: geometric mean over all of K's axes, units of the columns
  double friction_sd = 0;  // geometric mean of the standard deviations of friction's columns
  double share = 0;        // the largest share of any position, speed, acceleration or torque limit on a 1 ms grid
  double seconds = 0;      // the search took
  int searches = 0;
};

struct SearchSettings {
  double seconds = 55;  // at most; the number of starts is fixed, so that with time enough the seed decides alone
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;
};

// Ten coefficients a joint (Fourier: L = 5), period 10 s, offset allowed; fills in what came out.
void Excite(const codegen::Robot& file, const codegen::Catalogue& records, const SearchSettings& settings,
            ExcitedBy& excited);

// Fills in the figures of excited.series.
void Examine(const codegen::Robot& file, const codegen::Catalogue& records, ExcitedBy& excited);

// A trajectory that nothing was fitted to: a random series within the limits.
excitation::Series Validation(const codegen::Robot& file, const codegen::Catalogue& records, std::uint64_t seed);

}  // namespace armcal::survey
