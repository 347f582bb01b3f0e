// verdict - reads values of a JSON and puts them as a page shows them.
#include "host_sim/diagnose/verdict/json_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/identify/calibration/log_check.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

bool Slides(const ordered_json& json, int joint) {
  return json.at("torque_units").at(static_cast<std::size_t>(joint) - 1) == "N";
}

// "N*m" is "N", and "rad" is "m".
std::string UnitOfSlide(std::string unit) {
  for (const auto& [turning, sliding] :
       {std::pair<std::string, std::string>{"N*m", "N"}, {"kg*m^2", "kg"}, {"rad", "m"}})
    if (const auto at = unit.find(turning); at != unit.npos) unit.replace(at, turning.size(), sliding);
  return unit;
}

// The joint, from 1, that gives a column of this name its unit; 0: none of so many joints.
int JointOf(const std::string& name, const std::string& unit, std::size_t joints) {
  const bool of_joint = name.starts_with("Ia") || unit.find('N') != unit.npos || unit.find("rad") != unit.npos;
  const int joint = std::atoi(name.c_str() + name.find_last_not_of("0123456789") + 1);
  return of_joint && joint >= 1 && joint <= static_cast<int>(joints) ? joint : 0;
}

// Empty: the joint is called by its number.
std::string OwnName(const ordered_json& json, int joint) {
  const std::string own = json.at("joint_names").at(static_cast<std::size_t>(joint) - 1);
  return own == fmt::format("joint {}", joint) || own == fmt::format("axis {}", joint) ? "" : own;
}

}  // namespace

double NumberOf(const ordered_json& value) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  return std::isfinite(number) ? number : std::nan("");
}

std::vector<double> Numbers(const ordered_json& array) {
  std::vector<double> out;
  for (const ordered_json& value : array) out.push_back(NumberOf(value));
  return out;
}

std::string Interval95(double value, double sd) {
  constexpr double kTwoSided = 1.96;
  if (!(sd > 0)) return "-";
  return report::Number(value - kTwoSided * sd, 4) + " to " + report::Number(value + kTwoSided * sd, 4);
}

std::string JointTitle(const ordered_json& json, int joint) {
  const std::string own = OwnName(json, joint), plain = fmt::format("joint {}", joint);
  return own.empty() ? plain : plain + ", " + own;
}

std::vector<std::string> BarNames(const ordered_json& json) {
  const auto joints = static_cast<int>(json.at("joint_names").size());
  const std::size_t longest = 54 / static_cast<std::size_t>(std::max(1, joints));  // letters that fit below a bar
  std::vector<std::string> names, numbers;
  for (int joint = 1; joint <= joints; ++joint)
    names.push_back(OwnName(json, joint)), numbers.push_back(std::to_string(joint));
  const bool fit = std::all_of(names.begin(), names.end(),
                               [&](const std::string& name) { return !name.empty() && name.size() <= longest; });
  return fit ? names : numbers;
}

std::string UnitOn(const ordered_json& json, const std::vector<int>& joints, const std::string& unit) {
  if (joints.empty() || !std::all_of(joints.begin(), joints.end(), [&](int j) { return Slides(json, j); })) return unit;
  return UnitOfSlide(unit);
}

std::string ColumnUnit(const ordered_json& json, const std::string& name, const std::string& unit) {
  const int joint = JointOf(name, unit, json.at("torque_units").size());
  return joint > 0 ? UnitOn(json, {joint}, unit) : unit;
}

std::string UnitOn(const codegen::Robot& robot, const std::vector<int>& joints, const std::string& unit) {
  const auto slides = [&](int j) { return calibration::Slides(robot.joint[static_cast<std::size_t>(j)]); };
  return !joints.empty() && std::all_of(joints.begin(), joints.end(), slides) ? UnitOfSlide(unit) : unit;
}

std::string ColumnUnit(const codegen::Robot& robot, const std::string& name, const std::string& unit) {
  const int joint = JointOf(name, unit, robot.joint.size());
  return joint > 0 ? UnitOn(robot, {joint - 1}, unit) : unit;
}

}  // namespace armcal::verdict
