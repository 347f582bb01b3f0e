// excitation - searches the Fourier series with the smallest cond(K) that keeps the limits; knows no file and no drive.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>

#include "host_sim/excitation/objective.hpp"

namespace armcal::excitation {

struct OptimiseSettings {
  SeriesShape shape;
  double margin = 0.05;  // of every limit, kept free
  double seconds = 20;   // of wall clock
  int starts =
      std::numeric_limits<int>::max();  // random starts at most: with time enough the result follows from the seed
  int threads = 2;
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;  // set: return the best so far
  // Called from any of the threads, one at a time, after each start.
  std::function<void(int starts_done, double best_condition)> progress;
};

struct Optimum {
  Fourier series;
  double condition = 0;  // cond(K) of one period, 1000 samples
  int starts = 0;
};

// Local searches from random series by `seed`, the best kept. InputError: no series within the limits was found.
Optimum Optimise(const Observation& observation, const OptimiseSettings& settings);

// A random series within the limits (the searches' kind of start). False: not found within the limits for this seed.
bool RandomSeries(const Observation& observation, const OptimiseSettings& settings, std::uint64_t seed,
                  Fourier& series);

// cond(K) of one period on 1000 samples.
double PeriodCondition(const Observation& observation, const Fourier& series);

}  // namespace armcal::excitation
