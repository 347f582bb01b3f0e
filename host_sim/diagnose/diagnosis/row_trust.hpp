// diagnosis - says which rows of a log tell less than the others.
#pragma once

#include <Eigen/Core>

#include "codegen/src/generator/model.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

// [samples] 1 where the sign of a joint's friction hardly changes within the time that the derived speed resolves,
// else 0. Where it changes, a speed that is a little wrong gives a torque that is far wrong.
Eigen::VectorXd SteadyFriction(const codegen::Model& model, const calibration::Dataset& data, int joint);

// Weights of rows whose noise has heavy tails: a row weighs 1/sqrt(1 + u^2), as for noise with Student's t
// distribution. u: how far `left`, what the model leaves, is from the rows beside it. What lasts longer than a row is
// no noise. Empty if the tails are not heavy, or if the noise has a colour.
Eigen::VectorXd KnockWeights(const RowIndex& rows, const Eigen::VectorXd& left);

}  // namespace armcal::diagnosis
