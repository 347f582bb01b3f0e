// calibration - compares the bends of the acceleration with their median and with what the model leaves.
#include "host_sim/identify/calibration/jolts.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/data/logs/steps.hpp"

namespace armcal::calibration {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double kFarMore = 8;      // times the median: Gaussian noise is beyond that once in 10^7 samples
constexpr double kJoltReach = 0.5;  // periods of the lowest cut-off

}  // namespace

Eigen::MatrixXi BesideJolts(const Eigen::VectorXd& t, const MatrixXd& qdd, const Eigen::VectorXd& cutoff_Hz,
                            const MatrixXd& inertia, const Eigen::VectorXd& left) {
  const Index samples = qdd.rows(), inner = samples - 2;
  Eigen::MatrixXi beside = Eigen::MatrixXi::Zero(samples, qdd.cols());
  MatrixXd bend = MatrixXd::Zero(samples, qdd.cols());
  bend.middleRows(1, inner) = qdd.topRows(inner) - 2 * qdd.middleRows(1, inner) + qdd.bottomRows(inner);
  const MatrixXd torque = bend.cwiseAbs() * inertia.cwiseAbs().transpose();
  const double rate_Hz = static_cast<double>(samples - 1) / (t[samples - 1] - t[0]);
  const auto reach = static_cast<Index>(std::ceil(kJoltReach * rate_Hz / cutoff_Hz.minCoeff()));
  for (Index j = 0; j < qdd.cols(); ++j) {
    const double limit = std::max(left[j], kFarMore * logs::Median({torque.col(j).begin(), torque.col(j).end()}));
    for (Index k = 1; k <= inner; ++k) {
      if (torque(k, j) <= limit) continue;
      const Index first = std::max<Index>(0, k - reach), last = std::min(samples - 1, k + reach);
      beside.col(j).segment(first, last - first + 1).setOnes();
    }
  }
  return beside;
}

}  // namespace armcal::calibration
