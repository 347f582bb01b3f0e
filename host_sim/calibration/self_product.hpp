// calibration - the Gram matrix of tall columns at the price of one triangle; knows no log.
#pragma once

#include <Eigen/Core>

namespace armcal::calibration {

// m' m.
inline Eigen::MatrixXd SelfProduct(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(m.cols(), m.cols());
  out.selfadjointView<Eigen::Lower>().rankUpdate(m.transpose());
  out.triangularView<Eigen::StrictlyUpper>() = out.transpose();
  return out;
}

}  // namespace armcal::calibration
