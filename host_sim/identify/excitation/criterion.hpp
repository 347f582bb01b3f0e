// excitation - what makes a motion a good one, as a figure of the Gram matrix of K; knows no trajectory.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace armcal::excitation {

struct Criterion {
  enum class Kind {
    kCondition,  // (26): cond(K), columns scaled to unit norm
    kDOptimal,   // det(G)^(-1 / 2 n): the geometric mean of the standard deviations along G's axes
    kAccuracy    // the geometric mean of the standard deviations of the parameters `about`, all others unknown, too
  };
  Kind kind = Kind::kCondition;
  std::vector<int> about{};  // kAccuracy: places in the Gram matrix
};

// gram: sum of K' R^-1 K over the samples. Infinite if K is singular to working precision.
double Figure(const Criterion& criterion, const Eigen::MatrixXd& gram);

// Logarithm of the figure for a search, smooth (kCondition: a norm with p = 10 above it, within 2 log(n) / p), and its
// derivative by the Gram matrix. Infinite if K is singular, then without a derivative.
double SmoothFigure(const Criterion& criterion, const Eigen::MatrixXd& gram, Eigen::MatrixXd& derivative);

// Standard deviation of each parameter when all are estimated together, [n]; infinite if K is singular.
Eigen::VectorXd Deviations(const Eigen::MatrixXd& gram);

// Share of column a that no combination of the others explains, 0 (confused) to 1 (told apart): per column.
Eigen::VectorXd Separation(const Eigen::MatrixXd& gram);

}  // namespace armcal::excitation
