// calibration - parameters that are given and not fitted: those of a robot file, of a table, or of identify's JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "codegen/src/robot/payload.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::calibration {

struct Given {
  Eigen::VectorXd x;                    // [columns + n] filter columns and torque gain deviations, as in Fit
  Eigen::VectorXd bodies;               // [11 n] about the links' origins; empty: only base parameters are given
  std::vector<double> eta;              // nonlinear parameters of the model
  std::vector<std::string> missing;     // parameters that the file lacks: the robot file's value stands
  std::vector<std::string> from_prior;  // parameters of which the identification's logs say little, see TableRow
};

// The robot file's own values: bodies, friction and effects as they are. InputError: prior = "none".
Given GivenByRobot(const codegen::Model& model);

// The values of a table. InputError, one line: a body parameter is missing, a parameter that the model does not have
// and that is not zero, another number of joints.
Given GivenByTable(const codegen::Model& model, const TableFile& table, const std::string& source);

// By parameter names: what `armcal identify --json` wrote. With a prior its "table" counts, without one its "columns";
// the JSON of another method has "parameters". InputError as above, and where the file is no such JSON.
Given GivenByJson(const codegen::Model& model, const std::filesystem::path& path);

// A table, or identify's JSON, by the first character of the file.
Given GivenByFile(const codegen::Model& model, const std::filesystem::path& path);

// The last link carries the payload, too. InputError: a payload without centre or inertia.
void AddPayload(const codegen::Model& model, const codegen::Payload& payload, const std::string& source, Given& given);

}  // namespace armcal::calibration
