// logs - the time between samples: the usual step, and where samples are lost.
#include "host_sim/data/logs/steps.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace armcal::logs {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kLate = 0.5;  // steps
constexpr Index kRows = 15;    // on either side, whose stamps tell a late clock from a late stamp

// Of rows [first, end): their stamps, less as many steps as they are further on.
double Offset(const VectorXd& t, Index first, Index end, double step) {
  std::vector<double> offset;
  for (Index k = first; k < end; ++k) offset.push_back(t[k] - static_cast<double>(k) * step);
  return Median(std::move(offset));
}

}  // namespace

double Median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double MedianStep(const VectorXd& t) {
  std::vector<double> step;
  for (Index k = 1; k < t.size(); ++k)
    if (t[k] > t[k - 1]) step.push_back(t[k] - t[k - 1]);
  return Median(std::move(step));
}

std::vector<int> LostBehind(const VectorXd& t) {
  const double step = MedianStep(t);
  std::vector<int> open;
  for (Index k = 0; k + 1 < t.size(); ++k)
    if (t[k + 1] - t[k] > (1 + kLate) * step) open.push_back(static_cast<int>(k));
  std::set<Index> begins = {0, t.size()};  // of the stretches without a loss
  const auto late = [&](Index k) {         // the clock behind row k, within the stretch
    const auto next = begins.upper_bound(k);
    const Index begin = *std::prev(next), end = *next;
    if (end == k + 1) return 0.0;
    return Offset(t, k + 1, std::min(end, k + 1 + kRows), step) -
           Offset(t, std::max(begin, k + 1 - kRows), k + 1, step);
  };
  // Round by round the clearest loss of its neighbourhood: it moves the offsets of the rows beside it.
  std::vector<int> rows;
  for (bool found = true; found;) {
    std::vector<double> size;
    for (const int k : open) size.push_back(late(k));
    std::vector<int> rest;
    found = false;
    for (std::size_t at = 0; at < open.size(); ++at) {
      bool clearest = size[at] > kLate * step;
      for (std::size_t o = at; o > 0 && open[at] - open[o - 1] <= kRows; --o) clearest &= size[at] > size[o - 1];
      for (std::size_t o = at + 1; o < open.size() && open[o] - open[at] <= kRows; ++o) clearest &= size[at] >= size[o];
      if (clearest) rows.push_back(open[at]), begins.insert(open[at] + 1), found = true;
      else if (size[at] > kLate * step) rest.push_back(open[at]);
    }
    open = std::move(rest);
  }
  std::sort(rows.begin(), rows.end());
  // A late stamp may have been taken for the loss beside it; with that loss found, nothing is lost behind it.
  const auto is_none = [&](int k) {
    begins.erase(k + 1);
    if (late(k) <= kLate * step) return true;
    begins.insert(k + 1);
    return false;
  };
  rows.erase(std::remove_if(rows.begin(), rows.end(), is_none), rows.end());
  return rows;
}

}  // namespace armcal::logs
