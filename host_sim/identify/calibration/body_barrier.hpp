// calibration - the body that can exist nearest to an estimate that perhaps cannot; knows no arm.
#pragma once

#include <Eigen/Core>

namespace armcal::calibration {

// Minimum over p = (m, m c, I about the origin) of (p - estimate)' information (p - estimate) / 2 - eps / 2 logdet
// J(p), eps falling to 0.01, J the 4x4 pseudo-inertia (Wensing, Kim, Slotine 2018). Both parts are convex, so Newton's
// method with step halving finds it from any body; information: positive definite.
Eigen::VectorXd NearestBody(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& information);

// The ten parameters of a body in a frame -> in the frame in which that one has this pose [4x4]: a linear map, 10 x 10.
Eigen::MatrixXd BodyMap(const Eigen::Matrix4d& pose);

}  // namespace armcal::calibration
