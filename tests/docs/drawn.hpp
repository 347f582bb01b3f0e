// tests - makes a line of a picture small and the same on every build.
#pragma once

#include <Eigen/Core>

#include "host_sim/data/report/plot.hpp"

namespace armcal::tests {

// The curve y over x with few points. Values are rounded to a millionth of the largest one, because their last digits
// depend on the compiler. A point stays if the line without it would be off by more than a tenth of a pixel.
report::Series Curve(const std::string& name, const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                     bool logarithmic_x = false);

// The picture as a file, wide enough for its title. A picture of one line needs no legend.
std::string File(report::Plot plot);

}  // namespace armcal::tests
