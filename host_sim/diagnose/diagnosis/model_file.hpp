// diagnosis - a finding as a robot file that a model can be generated from; knows no search.
#pragma once

#include <string>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"

namespace armcal::diagnosis {

// The robot file with the confirmed terms added: each with its record, parameters and standard deviations, `provenance`
// and score as comments. What a model can hold is an [[effect]] table; of the rest a comment says what to do about it.
std::string ModelFile(const codegen::Model& model, const Finding& finding, const std::string& provenance);

}  // namespace armcal::diagnosis
