// methods - the pseudo-inverse (15), plain and with rows over sigma_j.
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>

#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Singular values below rows x rounding x the largest count as zero, as in MATLAB's pinv. Columns that the torque
// cannot tell apart leave rounding noise there; every other direction lies ten orders above.
double Threshold(Eigen::Index rows, Eigen::Index columns) {
  return static_cast<double>(std::max(rows, columns)) * std::numeric_limits<double>::epsilon();
}

Solution Solve(const Problem& problem, const char* name, bool weighted) {
  const double began = CpuSeconds();
  ExpectLinear(problem, name);
  const codegen::Model& model = *problem.model;
  const Rows rows = StackRows(problem, problem.start);
  std::vector<int> free;
  VectorXd held = problem.start.head(model.columns());
  for (const int c : FreeCoordinates(problem)) free.push_back(c), held[c] = 0;
  const auto count = static_cast<Eigen::Index>(free.size());

  // [K tau], with rows of zeros below where there are fewer rows than columns.
  MatrixXd A = MatrixXd::Zero(std::max(rows.K.rows(), count + 1), count + 1);
  for (Eigen::Index i = 0; i < count; ++i) A.col(i).head(rows.K.rows()) = rows.K.col(free[i]);
  A.col(count).head(rows.K.rows()) = rows.tau - rows.K * held;
  VectorXd sigma(rows.K.rows());
  for (Eigen::Index r = 0; r < sigma.size(); ++r) sigma[r] = problem.sigma_Nm[rows.joint[r]];
  if (weighted) A.topRows(sigma.size()).array().colwise() /= sigma.array();

  // K = Q R, so K^+ tau = R^+ Q' tau, and R is small.
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  const MatrixXd triangle = qr.matrixQR().topRows(count + 1).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(triangle.topLeftCorner(count, count),
                                                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double limit = Threshold(sigma.size(), count) * svd.singularValues()[0];
  VectorXd inverse = svd.singularValues();
  for (double& s : inverse) s = s > limit ? 1 / s : 0;
  const auto rank = (inverse.array() > 0).count();
  const VectorXd x =
      svd.matrixV() * (inverse.asDiagonal() * (svd.matrixU().transpose() * triangle.col(count).head(count)));

  // The covariance of K^+ tau under noise Sigma is K^+ Sigma K^+'. Directions that no row sees get no variance, because
  // the method takes them as zero.
  MatrixXd P = svd.matrixV() * inverse.cwiseAbs2().asDiagonal() * svd.matrixV().transpose();  // (K' K)^+
  if (!weighted) {
    const MatrixXd noisy = sigma.asDiagonal() * A.topLeftCorner(sigma.size(), count);
    P = (P * (noisy.transpose() * noisy) * P).eval();
  }
  Solution out;
  out.z = problem.start;
  out.covariance.setZero(problem.start.size(), problem.start.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    out.z[free[i]] = x[i];
    for (Eigen::Index k = 0; k < count; ++k) out.covariance(free[i], free[k]) = P(i, k);
  }
  out.bodies = SmallestBodies(model, out.z);
  out.iterations = 1;
  out.memory_bytes = sizeof(double) * static_cast<std::size_t>(rows.K.size() + 2 * A.size() + 5 * P.size());
  if (rank < count)
    out.remark = "rank " + std::to_string(rank) + " of " + std::to_string(count) + ": of all that fit, the smallest";
  Finish(problem, began, out);
  out.from_prior = 0;
  return out;
}

}  // namespace

Solution PseudoInverse(const Problem& problem) { return Solve(problem, "pseudo-inverse", false); }
Solution WeightedPseudoInverse(const Problem& problem) { return Solve(problem, "weighted pseudo-inverse", true); }

}  // namespace armcal::calibration
