// verdict - reads values of a JSON and puts them as a page shows them.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace armcal::verdict {

// A number of a JSON, and those of an array; NaN for null and for what is not finite.
double NumberOf(const nlohmann::ordered_json& value);
std::vector<double> Numbers(const nlohmann::ordered_json& array);

// "0.812 to 0.934": a value with a standard deviation, normally distributed; "-" without a deviation.
std::string Interval95(double value, double sd);

// "joint 2", or "joint 2, elbow" where the robot file has a name of its own. joint: from 1.
std::string JointTitle(const nlohmann::ordered_json& json, int joint);

// What stands below a joint's bar: its own name, or numbers from 1 where a name is too long for the place.
std::vector<std::string> BarNames(const nlohmann::ordered_json& json);

// A unit of a record as it is on these joints (from 1): "N*m" is "N" where all of them slide, and "rad" is "m".
std::string UnitOn(const nlohmann::ordered_json& json, const std::vector<int>& joints, const std::string& unit);

// The unit of a column of the model: "Fv2" belongs to joint 2. Bodies have the same units on all joints.
std::string ColumnUnit(const nlohmann::ordered_json& json, const std::string& name, const std::string& unit);

// The same for a robot. joints: from 0.
std::string UnitOn(const codegen::Robot& robot, const std::vector<int>& joints, const std::string& unit);
std::string ColumnUnit(const codegen::Robot& robot, const std::string& name, const std::string& unit);

}  // namespace armcal::verdict
