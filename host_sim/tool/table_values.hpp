// tool - what differs between two tables of one model, by the names of their values.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::tool {

struct ValueChange {
  std::string name;  // "joint 1 sigma_Nm", "m2", "m2 sd"
  nlohmann::ordered_json from, to;
};
std::vector<ValueChange> ChangesOf(const calibration::TableFile& from, const calibration::TableFile& to);
// Nine digits, which tell all floats apart.
std::string ValueText(const nlohmann::ordered_json& value);

}  // namespace armcal::tool
