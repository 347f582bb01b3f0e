// verdict - forms the jackknife's mean and variance, and Student's interval about them.
#include "host_sim/diagnose/verdict/spread.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace armcal::verdict {

namespace {

// 97.5 % quantile of Student's t. Above the table: Cornish and Fisher's expansion, right to 0.2 % there.
double StudentT(int freedom) {
  constexpr std::array<double, 10> kTable{12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  if (freedom <= static_cast<int>(kTable.size())) return kTable[static_cast<std::size_t>(freedom) - 1];
  const double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96.0 * freedom * freedom);
}

}  // namespace

Spread SpreadOf(const std::vector<double>& value, const std::vector<double>& sd) {
  const double groups = static_cast<double>(value.size()), others = groups - 1;
  Spread out;
  for (const double v : value) out.mean += v / groups;
  double of_pseudo_values = 0, within = 0;
  for (const double v : value) of_pseudo_values += others * (v - out.mean) * (v - out.mean);
  for (const double s : sd) within += others * s * s / groups;  // a refit has the rows of G - 1 groups
  const double between = std::max(0.0, of_pseudo_values - within);
  out.between = std::sqrt(between);
  out.sd = std::sqrt((between + within) / groups);
  const double reach = StudentT(static_cast<int>(value.size()) - 1) * out.sd;
  out.lower = out.mean - reach, out.upper = out.mean + reach;
  return out;
}

}  // namespace armcal::verdict
