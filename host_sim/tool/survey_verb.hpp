// tool - the command line of armcal survey, for the tool and for the program that does the work.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct SurveyOptions {
  std::string robot = "er20_like", json, report, data;
  std::vector<std::string> tables;
  std::string feedforward = "set";
  int draws = 200, slow_draws = 5;
  std::uint64_t seed = 1;
  double search_s = 55;
  int searches = 0;
};

// Adds the verb. run: its work, from the options and the verb as it was parsed.
void AddSurveyVerb(CLI::App& app, Action& action, std::function<int(const SurveyOptions&, const CLI::App&)> run);

}  // namespace armcal::tool
