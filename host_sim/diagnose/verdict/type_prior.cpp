// verdict - medians and median absolute deviations, which a few odd arms do not move.
#include "host_sim/diagnose/verdict/type_prior.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/data/logs/steps.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

constexpr std::size_t kFewest = 5;  // logs that make a type
constexpr double kFar = 5;          // deviations; one of a hundred parameters of a thousand arms is so by chance

struct Values {
  std::string unit;
  std::vector<double> value;
};

bool IsPositive(double x) { return std::isfinite(x) && x > 0; }

// The robot's name; empty: the verdict of an older armcal, or of a log that failed.
std::string RobotOf(const ordered_json& verdict) {
  return !Failed(verdict) && verdict.contains("robot") && verdict.at("robot").is_string() ? verdict.at("robot") : "";
}

struct Parameter {
  std::string name, unit;
  double value = 0, sd = 0;
};

std::vector<Parameter> DeclaredOf(const ordered_json& verdict) {
  std::vector<Parameter> out;
  for (const auto& p : verdict.value("declared_parameters", ordered_json::array())) {
    if (!p.is_object() || !p.contains("value") || !p.contains("sd")) continue;
    Parameter one{p.value("name", ""), p.value("unit", ""), NumberOf(p.at("value")), NumberOf(p.at("sd"))};
    if (std::isfinite(one.value)) out.push_back(std::move(one));
  }
  return out;
}

}  // namespace

ordered_json TypesJson(const Verdicts& verdicts) {
  std::map<std::string, std::map<std::string, Values>> types;  // robot -> parameter
  std::map<std::string, std::size_t> logs;
  for (const auto& [name, verdict] : verdicts) {
    const std::string robot = RobotOf(verdict);
    if (robot.empty()) continue;
    ++logs[robot];
    for (const Parameter& p : DeclaredOf(verdict)) {
      Values& all = types[robot][p.name];
      all.unit = p.unit, all.value.push_back(p.value);
    }
  }
  ordered_json out = ordered_json::array();
  for (const auto& [robot, parameters] : types) {
    ordered_json list = ordered_json::array();
    for (const auto& [name, all] : parameters) {
      if (all.value.size() < kFewest) continue;
      const double median = logs::Median(all.value);
      std::vector<double> off;
      for (const double value : all.value) off.push_back(std::abs(value - median));
      list.push_back({{"name", name}, {"unit", all.unit}, {"median", median}, {"spread", 1.4826 * logs::Median(off)}});
    }
    if (!list.empty()) out.push_back({{"robot", robot}, {"logs", logs.at(robot)}, {"parameters", list}});
  }
  return out;
}

ordered_json FarFromType(const ordered_json& types, const ordered_json& verdict) {
  std::vector<ordered_json> far;
  for (const auto& type : types) {
    if (type.at("robot") != RobotOf(verdict)) continue;
    const auto& of_type = type.at("parameters");
    for (const Parameter& p : DeclaredOf(verdict)) {
      const auto same =
          std::find_if(of_type.begin(), of_type.end(), [&p](const auto& t) { return t.at("name") == p.name; });
      if (same == of_type.end()) continue;
      const double median = same->at("median"), spread = same->at("spread"), off = std::abs(p.value - median);
      const double deviation = std::hypot(spread, IsPositive(p.sd) ? p.sd : 0);
      if (!IsPositive(deviation) || off < kFar * deviation) continue;
      far.push_back({{"parameter", p.name},
                     {"unit", p.unit},
                     {"value", p.value},
                     {"sd", p.sd},
                     {"median", median},
                     {"spread", spread},
                     {"deviations", off / deviation}});
    }
  }
  std::stable_sort(far.begin(), far.end(),
                   [](const auto& a, const auto& b) { return a.at("deviations") > b.at("deviations"); });
  return far;
}

}  // namespace armcal::verdict
