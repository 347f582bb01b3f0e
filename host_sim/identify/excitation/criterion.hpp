// excitation - the criteria that rate a motion. Each is a figure of the Gram matrix of K.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace armcal::excitation {

struct Criterion {
  enum class Kind {
    kCondition,  // (26): cond(K), columns scaled to unit norm
    kDOptimal,   // det(G)^(-1 / 2 n): the geometric mean of the standard deviations along G's axes
    kAccuracy    // the geometric mean of the standard deviations of the parameters `about`, with all others unknown
  };
  Kind kind = Kind::kCondition;
  std::vector<int> about{};  // kAccuracy: places in the Gram matrix
};

// gram: sum of K' R^-1 K over the samples. Infinite if K is singular to working precision.
double Figure(const Criterion& criterion, const Eigen::MatrixXd& gram);

// A smooth logarithm of the figure, for searches, and its derivative by the Gram matrix. For kCondition it is a norm
// with p = 10, above the figure by at most 2 log(n) / p. Infinite, without a derivative, if K is singular.
double SmoothFigure(const Criterion& criterion, const Eigen::MatrixXd& gram, Eigen::MatrixXd& derivative);

// Standard deviation of each parameter when all are estimated together, [n]; infinite if K is singular.
Eigen::VectorXd Deviations(const Eigen::MatrixXd& gram);

// Share of column a that no combination of the others explains, 0 (confused) to 1 (told apart): per column.
Eigen::VectorXd Separation(const Eigen::MatrixXd& gram);

}  // namespace armcal::excitation
