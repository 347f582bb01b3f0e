// cli - the exogeneity test of armcal identify: which instruments the logs allow, and what is printed; knows no fit.
#pragma once

#include <nlohmann/json.hpp>

#include "host_sim/calibration/exogeneity.hpp"
#include "host_sim/cli/logs.hpp"

namespace armcal::cli {

inline constexpr const char* kSimulatedLoop = "simulated loop";

// Instruments from the simulated loop where the robot file has a control law and every log a reference, else from the
// reference, else from smoothed positions. z: [columns, eta].
calibration::Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<calibration::Dataset>& data,
                                        const Eigen::VectorXd& z);

std::string ExogeneityText(const calibration::Exogeneity& e);
nlohmann::ordered_json ToJson(const calibration::Exogeneity& e);

}  // namespace armcal::cli
