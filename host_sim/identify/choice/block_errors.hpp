// choice - sums of squared errors over stretches of a log, and what they say of two models.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/choice/choose.hpp"

namespace armcal::choice {

// Equal stretches of a log, two seconds or a tenth of a short log.
struct Stretches {
  explicit Stretches(const calibration::Dataset& log);
  int Of(Eigen::Index sample) const;
  int count = 0;
  Eigen::Index samples = 0;  // of one
};

// The log without the rows of some stretches: those whose number gives this remainder by `folds`. It is for methods
// that fit samples, so it holds no averages.
calibration::Dataset Without(const calibration::Dataset& log, int remainder, int folds);

// [stretches x joints] sum of the squares of a residual's rows [N x n]: averages where the band is limited, else the
// used samples.
Eigen::MatrixXd SquaresByStretch(const calibration::Dataset& log, const Eigen::MatrixXd& residual);

// sqrt(sum a / sum b) - 1 of the sums of one joint over the same stretches; NaN where the joint has no row.
Ratio Compare(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace armcal::choice
