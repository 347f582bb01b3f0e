// verdict - gives the curves of a held-out log that a page shows: torque over time, and spectra.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/diagnose/verdict/verdict.hpp"

namespace armcal::verdict {

// [n] Up to which frequency the training logs were compared with the model.
Eigen::VectorXd LookedAtTo_Hz(const DiagnosisView& v);

// What a model predicts for one joint.
struct JointPrediction {
  std::string name;
  Eigen::VectorXd torque;
};

// Of one joint: {"joint", "t", "measured", each prediction by its name, "spectrum": {"Hz", "measured", what each
// prediction leaves, by its name}}. A prediction is null where the log's row is not used: there friction is not known.
// Such rows count as zero in spectra. Rows are thinned so that no peak is lost, of what predictions leave neither. At
// least one prediction.
nlohmann::ordered_json CurvesOf(const calibration::Dataset& log, int joint, std::vector<JointPrediction> predicted);

// One entry a joint of the held-out log: before, after.
nlohmann::ordered_json CurvesJson(const DiagnosisView& v);

}  // namespace armcal::verdict
