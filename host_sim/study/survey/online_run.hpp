// survey - the firmware's own estimator, float32, on a log.
#pragma once

#include <Eigen/Core>
#include <string>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::survey {

enum class OnlineFilter { kForgetting, kKalman, kExtended };  // kExtended: of the arm with (4)
std::string Name(OnlineFilter filter);

struct OnlineResult {
  calibration::Solution solution;     // of the physical read-out; covariance: its diagonal alone
  Eigen::VectorXd filter, filter_sd;  // [columns] of the filter's own read-out
  bool inconsistent = false;          // monitor::InnovationTest, or estimator::PriorIsTooNarrow
};

// Whether a joint's row of a sample counts for the estimator.
bool Moves(double speed_radps, const codegen::Joint& joint);

// True if the filter is compiled for this model.
bool CompiledFor(const codegen::Model& model, OnlineFilter filter);

// It starts from the table of `prior`, with sigma_Nm of a sample's row. Rows below a joint's v_min and rows that the
// log does not use are left out, as on a drive. Breakaway and Stribeck speed get wide deviations: CAD gives them
// badly. io::InputError: another arm, or a prior whose bodies cannot exist.
OnlineResult RunOnTarget(const codegen::Model& prior, const calibration::Dataset& log, const Eigen::VectorXd& sigma_Nm,
                         OnlineFilter filter);

}  // namespace armcal::survey
