// cli - the exogeneity test of armcal identify and diagnose: which instruments the logs allow, and what is printed;
// knows no fit.
#pragma once

#include <nlohmann/json.hpp>

#include "host_sim/calibration/exogeneity.hpp"
#include "host_sim/cli/logs.hpp"

namespace armcal::cli {

inline constexpr const char* kSimulatedLoop = "simulated loop";

// The best instruments that are asked for; a simulation takes seconds.
enum class Instruments { kSimulated, kCommanded };

// Instruments from the simulated loop where the robot file has a control law and every log a reference, else from the
// reference, else from smoothed positions. z: [columns, eta].
calibration::Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<calibration::Dataset>& data,
                                        const Eigen::VectorXd& z, Instruments best);

// Which joints hold, which fail, where it cannot be told; and what to do. otherwise: what else may make it fail.
std::string ExogeneityText(const calibration::Exogeneity& e, const std::string& otherwise);
inline constexpr const char* kLacksMore = "the model lacks a torque that no record describes";
nlohmann::ordered_json ToJson(const calibration::Exogeneity& e);

}  // namespace armcal::cli
