// calibration - products of matrices with many rows and few columns.
#pragma once

#include <Eigen/Core>

namespace armcal::calibration {

using Tall = Eigen::Ref<const Eigen::MatrixXd>;

Eigen::MatrixXd TallProduct(const Tall& a, const Tall& b);  // a' b
Eigen::MatrixXd SelfProduct(const Tall& m);                 // m' m, at the price of one triangle

}  // namespace armcal::calibration
