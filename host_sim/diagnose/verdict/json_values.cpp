// verdict - reads values of a JSON and puts them as a page shows them.
#include "host_sim/diagnose/verdict/json_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "host_sim/data/report/axis.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

bool Slides(const ordered_json& json, int joint) {
  return json.at("torque_units").at(static_cast<std::size_t>(joint) - 1) == "N";
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
  const std::string own = json.at("joint_names").at(static_cast<std::size_t>(joint) - 1);
  const std::string plain = fmt::format("joint {}", joint);
  return own.empty() || own == plain || own == fmt::format("axis {}", joint) ? plain : plain + ", " + own;
}

std::string UnitOn(const ordered_json& json, const std::vector<int>& joints, const std::string& unit) {
  if (joints.empty() || !std::all_of(joints.begin(), joints.end(), [&](int j) { return Slides(json, j); })) return unit;
  std::string out = unit;
  for (const auto& [turning, sliding] :
       {std::pair<std::string, std::string>{"N*m", "N"}, {"kg*m^2", "kg"}, {"rad", "m"}})
    if (const auto at = out.find(turning); at != out.npos) out.replace(at, turning.size(), sliding);
  return out;
}

std::string ColumnUnit(const ordered_json& json, const std::string& name, const std::string& unit) {
  const auto digits = name.find_last_not_of("0123456789") + 1;
  const bool of_joint = name.starts_with("Ia") || unit.find('N') != unit.npos || unit.find("rad") != unit.npos;
  const int joint = std::atoi(name.c_str() + digits);
  const bool known = joint >= 1 && joint <= static_cast<int>(json.at("torque_units").size());
  return of_joint && known ? UnitOn(json, {joint}, unit) : unit;
}

}  // namespace armcal::verdict
