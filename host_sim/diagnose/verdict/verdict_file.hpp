// verdict - the JSON of armcal diagnose, as other verbs read it; writes none.
#pragma once

#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"

namespace armcal::verdict {

// "5-6" of joints counted from 0.
std::string JointNumbers(const std::vector<int>& joints);

// "stribeck:2", "wrist_coupling:5-6", "base_tilt": an effect as armcal excite --separate takes it.
std::string EffectWord(const std::string& record, const std::vector<int>& joints);

// What a verdict found of these effects ("record", "record:2", "record:1-2"): joints and nonlinear parameters. An empty
// path: nothing. Throws io::InputError: no verdict, or none of its terms is among them and has such parameters.
std::vector<codegen::EffectUse> ReadFound(const std::string& path, const std::vector<std::string>& effects);

}  // namespace armcal::verdict
