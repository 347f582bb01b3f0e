// calibration - finds the samples at which derived accelerations are wrong, because the true ones jump.
#pragma once

#include <Eigen/Core>

namespace armcal::calibration {

// [N x n] 1: beside a jolt. The acceleration of a joint jumps where it, or another one, sticks or breaks away. The
// samples do not tell when between two of them, so the derived acceleration is wrong by much of the jump for half a
// period of the cut-off. The torque of each joint that feels the acceleration shows that. A jolt is where the derived
// acceleration bends from sample to sample by more torque than the model mostly leaves, and by far more than it mostly
// does: noise of the encoder and fast motion bend it everywhere.
// t: [N] s. qdd: [N x n], cutoff_Hz: [n] it was derived with. inertia: a typical mass matrix [n x n], kg m^2 (kg).
// left: [n] standard deviation of what a first fit leaves, N m (N).
Eigen::MatrixXi BesideJolts(const Eigen::VectorXd& t, const Eigen::MatrixXd& qdd, const Eigen::VectorXd& cutoff_Hz,
                            const Eigen::MatrixXd& inertia, const Eigen::VectorXd& left);

}  // namespace armcal::calibration
