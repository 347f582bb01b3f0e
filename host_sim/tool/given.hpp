// tool - the options that name a model whose parameters are given: a robot file, a table beside it, a payload.
#pragma once

#include <string>

#include "host_sim/identify/calibration/given.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct GivenOptions {
  std::string robot, table, model, payload;
};

void AddGivenOptions(CLI::App& verb, GivenOptions& o);
// InputError: neither --robot nor --model, or two different robots.
codegen::Model GivenModel(const GivenOptions& o);
// What the file lacks is said on stderr, a line in all.
calibration::Given ReadGiven(const GivenOptions& o, const codegen::Model& model);
// What was given, for the verb's JSON.
nlohmann::ordered_json ToJson(const GivenOptions& o, const codegen::Model& model);

}  // namespace armcal::tool
