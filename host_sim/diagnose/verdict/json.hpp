// verdict - writes one diagnosis as JSON, and reads such files.
#pragma once

#include <filesystem>
#include <map>
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

// Verdicts by the name of their log, as armcal diagnose --json writes them, or the reason why there is none.
using Verdicts = std::map<std::string, nlohmann::ordered_json>;

// {"verdict": "failed", "error": why}, what a log without a verdict leaves behind.
nlohmann::ordered_json FailedVerdict(const std::string& why);

// A term's joint as a verdict has it: a number, or words as "5-6".
std::string JointText(const nlohmann::ordered_json& joint);

// A file that holds no verdict is a failed one that says so.
nlohmann::ordered_json ReadVerdict(const std::filesystem::path& path);

// Every NAME.json of folders, and files as they are. InputError: no such file, or two of one name.
Verdicts ReadVerdicts(const std::vector<std::string>& paths);

}  // namespace armcal::verdict
