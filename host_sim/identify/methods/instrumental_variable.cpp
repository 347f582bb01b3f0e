// methods - IDIM-IV, (17): instruments from a simulation of the estimate, so noise in q does not bias;
// knows no truth.
//
// (17) phi = (Z'K)^-1 Z'tau with Z = K along the simulated motion. Here weighted by 1 / sigma^2 and, where there is a
// prior, z = z0 + (Z'WK + P^-1)^-1 Z'W (tau - K z0), which also has a solution for standard parameters. The survey's
// sentence stands that the simulation takes the real one's reference and control law: Problem::closed_loop, at the
// current estimate, never a true one. Nonlinear laws: K and Z hold d tau / d eta, too, and (17) is the step.
#include <Eigen/LU>
#include <Eigen/SVD>

#include "host_sim/identify/methods/better_methods.hpp"
#include "host_sim/identify/methods/linearised.hpp"
#include "host_sim/identify/methods/simulated_logs.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kLoopRounds = 8;    // three are usual
constexpr double kUnseen = 1e-9;  // singular value, relative, of directions that (17) cannot see

// The step from z, and the covariance of the estimate behind it.
VectorXd Step(const Problem& problem, const VectorXd& z, const Linearised& K, const Linearised& Z,
              MatrixXd& covariance) {
  MatrixXd L;
  if (problem.covariance.size() > 0) {
    L = PriorFactor(problem);
  } else {  // free coordinates, columns of unit norm
    const std::vector<int> free = FreeCoordinates(problem);
    L = MatrixXd::Zero(z.size(), static_cast<Eigen::Index>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i) {
      const double norm = Z.A.col(free[i]).norm();
      L(free[i], static_cast<Eigen::Index>(i)) = norm > 0 ? 1 / norm : 0;
    }
  }
  const MatrixXd ZL = Z.A * L;
  MatrixXd M = ZL.transpose() * (K.A * L);
  const VectorXd target = K.residual + K.A * (z - problem.start);  // tau - K z0, whitened
  const VectorXd right = ZL.transpose() * target;
  const MatrixXd spread = ZL.transpose() * ZL;
  MatrixXd inverse;
  if (problem.covariance.size() > 0) {
    M.diagonal().array() += 1;
    inverse = M.partialPivLu().inverse();
    // w errs by M^-1 (Z' noise + prior): covariance M^-1 (Z'Z + 1) M^-T.
    const MatrixXd middle = spread + MatrixXd::Identity(M.rows(), M.cols());
    covariance = L * (inverse * middle * inverse.transpose()) * L.transpose();
  } else {
    const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const VectorXd s = svd.singularValues();
    VectorXd reciprocal(s.size());
    for (Eigen::Index k = 0; k < s.size(); ++k) reciprocal[k] = s[k] > kUnseen * s[0] ? 1 / s[k] : 0;
    inverse = svd.matrixV() * reciprocal.asDiagonal() * svd.matrixU().transpose();
    covariance = L * (inverse * spread * inverse.transpose()) * L.transpose();
  }
  return problem.start + L * (inverse * right);
}

}  // namespace

Solution InstrumentalVariable(const Problem& problem) {
  return IterateOnLoop(problem, "instrumental_variable", kLoopRounds,
                       [&](const std::vector<Dataset>& simulated, const VectorXd& z, Solution& solution) {
                         const Linearised measured = Linearise(problem, z);
                         solution.memory_bytes = 4 * static_cast<std::size_t>(measured.A.size()) * sizeof(double);
                         return Step(problem, z, measured, Linearise(Along(problem, simulated), z),
                                     solution.covariance);
                       });
}

}  // namespace armcal::calibration
