// survey - the firmware's own estimator, float32, on a log; compiled for the survey's arm with (7) and with (4);
// knows no truth.
#pragma once

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

// True if the filter is compiled for this model.
bool CompiledFor(const codegen::Model& model, OnlineFilter filter);

// prior: its table is where the filter starts, with sigma_Nm of a sample's row. Rows below a joint's v_min are left
// out, as on a drive. What CAD knows of breakaway and Stribeck speed is wide: see online_arm.cpp. io::InputError:
// another arm, or a prior whose bodies cannot exist.
OnlineResult RunOnTarget(const codegen::Model& prior, const calibration::Dataset& log, const Eigen::VectorXd& sigma_Nm,
                         OnlineFilter filter);

// Whether joint j's row of a sample counts for the estimator.
bool Moves(double speed_radps, const codegen::Joint& joint);

}  // namespace armcal::survey
