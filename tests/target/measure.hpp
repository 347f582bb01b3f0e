// tests - the cost of one call, and the extremes of many.
#pragma once

#include "port/runner/runner.hpp"

namespace armcal::target {

// In the runner's unit, without what the measurement costs by itself.
template <class Call>
std::uint32_t CostOf(Call call) {
  using namespace port::runner;  // NOLINT: the counter
  static const std::uint32_t empty = [] {
    const std::uint32_t from = Count();
    return Spent(from, Count());
  }();
  const std::uint32_t from = Count();
  call();
  return Spent(from, Count()) - empty;
}

struct Range {
  std::uint32_t most = 0, least = ~0u;
  void Add(std::uint32_t value) {
    most = value > most ? value : most;
    least = value < least ? value : least;
  }
};

// A line for each estimator: see estimator_cost.cpp.
void MeasureEstimators();
// Of the physical read-out: see read_out_cost.cpp.
void MeasureReadOut();

}  // namespace armcal::target
