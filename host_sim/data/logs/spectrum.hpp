// logs - shows how the power of a signal is spread over frequency.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace armcal::logs {

struct Spectrum {
  std::vector<double> f_Hz, density;  // the signal's unit per square root of Hz
};

// Welch's method with Hann's window over segments of segment_s, each without its mean; then means of the power over
// bins of a 24th of a decade. The integral of density^2 over f_Hz is the signal's variance. Empty: shorter than a
// segment.
Spectrum AmplitudeDensity(const Eigen::VectorXd& y, double rate_Hz, double segment_s);

}  // namespace armcal::logs
