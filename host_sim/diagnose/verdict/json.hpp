// verdict - writes one diagnosis as JSON, and reads the terms in such a file.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/diagnose/diagnosis/known_term.hpp"
#include "host_sim/diagnose/verdict/verdict.hpp"

namespace armcal::verdict {

// {"robot", "robot_title", "joint_names", "torque_units"}: what a page calls the arm and its joints.
void AddRobot(nlohmann::ordered_json& json, const codegen::Robot& robot);

// The verdict, its terms with their evidence, and the errors.
nlohmann::ordered_json DiagnosisJson(const DiagnosisView& v);

// What a verdict found of these effects ("record", "record:2", "record:1-2"): joints and nonlinear parameters. An empty
// path: nothing. Throws io::InputError: no verdict, or none of its terms is among them and has such parameters.
std::vector<codegen::EffectUse> ReadFound(const std::string& path, const std::vector<std::string>& effects);

// A term of a verdict, and the covariance of its eta and amplitudes. InputError: it was written by another version, or
// its record is not in the catalogue.
diagnosis::KnownTerm ReadKnownTerm(const nlohmann::ordered_json& term, const codegen::Catalogue& catalogue,
                                   Eigen::MatrixXd& covariance);

}  // namespace armcal::verdict
