// methods - the steps that several methods share: linearise the model, solve with a prior, read out the bodies.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// Whitened rows of the used samples at z: A = d tau / d z over sigma_j, residual = (tau - K(eta) p) over sigma_j.
struct Linearised {
  Eigen::MatrixXd A;         // [rows x z]
  Eigen::VectorXd residual;  // [rows]
  std::vector<int> joint;
};
Linearised Linearise(const Problem& problem, const Eigen::VectorXd& z);

// A method has settled when no coordinate changes by more than this share of its standard deviation.
inline constexpr double kSettled = 1e-3;

// Coordinates that a method may move: rigid columns, columns whose state is "estimated", eta that has a range.
std::vector<int> FreeCoordinates(const Problem& problem);

// Minimises |target - A z|^2 + (z - start)' P^-1 (z - start) over the free coordinates, given gram = A'A and right =
// A'target. Without a prior, directions that no row sees stay at the start. covariance may be null.
Eigen::VectorXd SolveRegularised(const Problem& problem, const Eigen::MatrixXd& gram, const Eigen::VectorXd& right,
                                 Eigen::MatrixXd* covariance);

// A matrix L with L L' = P over the free coordinates; rows of the other ones are zero. Then z = start + L w, where w
// has unit covariance.
Eigen::MatrixXd PriorFactor(const Problem& problem);

// Cuts eta to [lower, upper], since the prior's Gaussian may reach beyond the range for which eta's functions are made.
void ClampEta(const Problem& problem, Eigen::VectorXd& z);

bool Stopped(const Problem& problem);

// CPU time of this thread, s.
double CpuSeconds();

// Fills bodies (unless there are some), physical, from_prior, seconds since `began`.
void Finish(const Problem& problem, double began, Solution& solution);

// InputError unless every nonlinear parameter is held (its range is a point).
void ExpectLinear(const Problem& problem, const char* method);

// True if this column of the joint reads a nonlinear parameter.
bool Varies(const codegen::Model& model, int joint, int column);

// The bodies of smallest norm that give the filter coordinates of z: B^+ p. This equals the pseudo-inverse over all
// columns, also where z holds independent columns only, because (A B)^+ = B^+ A^+ if A has full column rank and B full
// row rank.
Eigen::VectorXd SmallestBodies(const codegen::Model& model, const Eigen::VectorXd& z);

}  // namespace armcal::calibration
