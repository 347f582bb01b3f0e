// methods - what the methods without a prior share: which rows they see, and bodies of smallest norm.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// InputError unless every nonlinear parameter is held (its range is a point).
void ExpectLinear(const Problem& problem, const char* method);

// Column c of joint j reads a nonlinear parameter.
bool Varies(const codegen::Model& model, int joint, int column);

// The bodies of smallest norm that give the filter coordinates of z: B^+ p. With independent columns as with all
// columns this is what the pseudo-inverse over all columns gives, because (A B)^+ = B^+ A^+ where A has full column
// and B full row rank.
Eigen::VectorXd SmallestBodies(const codegen::Model& model, const Eigen::VectorXd& z);

}  // namespace armcal::calibration
