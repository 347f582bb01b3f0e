// health - the likeliest step, and where inside its two slices.
#include "host_sim/diagnose/health/onset.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::health {
namespace {

struct Sum {
  double count = 0, square = 0;
  void Add(const client::ResidualSlice& s) { count += s.count, square += s.square; }
  double mean() const { return count > 0 ? square / count : 0; }
};

Sum Over(const std::vector<client::ResidualSlice>& slices, std::size_t first, std::size_t end) {
  Sum sum;
  for (std::size_t i = first; i < end; ++i) sum.Add(slices[i]);
  return sum;
}

}  // namespace

std::optional<Onset> FindOnset(const std::vector<client::ResidualSlice>& all, double elapsed_s) {
  std::vector<client::ResidualSlice> slices;  // in which the joint moved
  std::vector<double> end_s;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].count <= 0) continue;
    slices.push_back(all[i]);
    end_s.push_back(i + 1 < all.size() ? all[i + 1].start_s : elapsed_s);
  }
  std::optional<std::size_t> step;  // first slice after it
  double least = 0;
  for (std::size_t k = 1; k < slices.size(); ++k) {
    const Sum before = Over(slices, 0, k), after = Over(slices, k, slices.size());
    if (after.mean() <= before.mean() || before.mean() <= 0) continue;
    const double cost = before.count * std::log(before.mean()) + after.count * std::log(after.mean());
    if (!step || cost < least) step = k, least = cost;
  }
  if (!step) return std::nullopt;
  // The change may have begun inside either slice at the step; the part of the growth that is missing there says how
  // late. Levels are taken from the slices beyond them, as far as there are any.
  const std::size_t k = *step;
  const double low = Over(slices, 0, k > 1 ? k - 1 : k).mean();
  const double high = Over(slices, k + 1 < slices.size() ? k + 1 : k, slices.size()).mean();
  const auto changed_part = [&](std::size_t i) {
    return high > low ? std::clamp((slices[i].square / slices[i].count - low) / (high - low), 0.0, 1.0) : 1.0;
  };
  Onset onset{0, slices[k - 1].start_s, end_s[k]};
  onset.at_s = end_s[k] - changed_part(k) * (end_s[k] - slices[k].start_s) -
               changed_part(k - 1) * (end_s[k - 1] - slices[k - 1].start_s);
  return onset;
}

}  // namespace armcal::health
