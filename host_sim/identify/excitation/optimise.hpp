// excitation - searches the series that a criterion likes best and that keeps the limits; knows no file and no drive.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "host_sim/identify/excitation/objective.hpp"

namespace armcal::excitation {

enum class Search {
  kGradient,  // local searches from random series
  kGenetic    // the survey's genetic algorithm, again and again
};

struct OptimiseSettings {
  SeriesShape shape;
  Criterion criterion;
  Search search = Search::kGradient;
  double margin = 0.05;  // of every limit, kept free
  double seconds = 20;   // of wall clock
  int starts =
      std::numeric_limits<int>::max();  // random starts at most: with time enough the result follows from the seed
  int threads = 2;
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;  // set: return the best so far
  // Called from any of the threads, one at a time, after each start.
  std::function<void(int starts_done, double best_figure)> progress;
};

struct Optimum {
  excitation::Series series;
  double figure = 0;  // the criterion's, of one period at kPeriodSamples
  int starts = 0;
};
inline constexpr int kPeriodSamples = 1000;

// The best of searches by `seed`. InputError: no series within the limits was found.
Optimum Optimise(const Observation& observation, const OptimiseSettings& settings);

// A random series within the limits (the searches' kind of start). False: not found within the limits for this seed.
bool RandomSeries(const Observation& observation, const OptimiseSettings& settings, std::uint64_t seed,
                  excitation::Series& series);

// G of one period on kPeriodSamples, and its cond(K).
Eigen::MatrixXd PeriodGram(const Observation& observation, const excitation::Series& series);
double PeriodCondition(const Observation& observation, const excitation::Series& series);

}  // namespace armcal::excitation
