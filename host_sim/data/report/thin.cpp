// report - finds the extremes of each stretch of a series.
#include "host_sim/data/report/thin.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace armcal::report {

namespace {

// Appends the extremes and the first gap of y over [first, last).
void KeepOfStretch(const std::vector<double>& y, std::size_t first, std::size_t last, std::vector<std::size_t>& keep) {
  const std::size_t none = last;
  std::size_t low = none, high = none, gap = none;
  for (std::size_t k = first; k < last; ++k) {
    if (!std::isfinite(y[k])) {
      if (gap == none) gap = k;
      continue;
    }
    if (low == none || y[k] < y[low]) low = k;
    if (high == none || y[k] > y[high]) high = k;
  }
  for (const std::size_t k : {low, high, gap})
    if (k != none) keep.push_back(k);
}

}  // namespace

std::vector<std::size_t> KeepExtremes(const std::vector<const std::vector<double>*>& columns, std::size_t stretches) {
  const std::size_t rows = columns.empty() ? 0 : columns[0]->size();
  std::vector<std::size_t> keep;
  if (rows <= 2 * stretches * columns.size()) {
    keep.resize(rows);
    std::iota(keep.begin(), keep.end(), std::size_t{0});
    return keep;
  }
  keep = {0, rows - 1};
  for (std::size_t s = 0; s < stretches; ++s)
    for (const auto* column : columns) KeepOfStretch(*column, s * rows / stretches, (s + 1) * rows / stretches, keep);
  std::sort(keep.begin(), keep.end());
  keep.erase(std::unique(keep.begin(), keep.end()), keep.end());
  return keep;
}

}  // namespace armcal::report
