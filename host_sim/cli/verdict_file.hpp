// cli - the JSON of armcal diagnose, as other verbs read it; writes none.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"

namespace armcal::cli {

// What a verdict found of these effects ("record", "record:2", "record:1-2"): joints and nonlinear parameters. An empty
// path: nothing. Throws io::InputError: no verdict, or none of its terms is among them and has such parameters.
std::vector<codegen::EffectUse> ReadFound(const std::string& path, const std::vector<std::string>& effects);

}  // namespace armcal::cli
