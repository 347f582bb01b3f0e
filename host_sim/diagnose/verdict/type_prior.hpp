// verdict - what the arms of one type have in common, and which arm differs.
#pragma once

#include "host_sim/diagnose/verdict/verdict_file.hpp"

namespace armcal::verdict {

// Of each robot with at least five verdicts: {"robot", "logs", "parameters": [{"name", "unit", "median", "spread"}]} of
// the declared parameters that at least five of its logs determine. spread: the standard deviation of normal values
// with the same median absolute deviation; it holds the arms' own differences and what the logs leave open.
nlohmann::ordered_json TypesJson(const Verdicts& verdicts);

// The parameters of a verdict that lie more than five deviations from its type's medians, farthest first:
// {"parameter", "unit", "value", "sd", "median", "spread", "deviations"}. A deviation is that of the spread and of the
// value's own sd together. types: of TypesJson.
nlohmann::ordered_json FarFromType(const nlohmann::ordered_json& types, const nlohmann::ordered_json& verdict);

}  // namespace armcal::verdict
