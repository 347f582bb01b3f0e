// verdict - computes the mean of a parameter over the splits of several runs, with an interval that holds their spread.
//
// Splits share training runs, so their estimates are not independent: they lie closer together than estimates from one
// run each. The delete-one-group jackknife takes that into account. With G groups and theta_g the estimate from all
// groups but g, the pseudo-value p_g = mean - (G - 1) (theta_g - mean) stands for group g alone. The p_g are treated as
// in a random-effects mean (DerSimonian and Laird 1986; equal weights): their variance is that within a group, which
// the refits state, and that between groups. (B. Efron, The Jackknife, the Bootstrap and Other Resampling Plans, 1982.)
#pragma once

#include <vector>

namespace armcal::verdict {

struct Spread {
  double mean = 0;
  double sd = 0;       // of the mean: between and within groups
  double between = 0;  // standard deviation of one group's true value about the mean; 0: within explains it all
  double lower = 0, upper = 0;  // 95 %, Student's t with groups - 1 degrees of freedom
};

// value[g], sd[g]: estimate from all groups but g, and its standard deviation as that fit states it; G >= 2.
Spread SpreadOf(const std::vector<double>& value, const std::vector<double>& sd);

}  // namespace armcal::verdict
