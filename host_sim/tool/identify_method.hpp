// tool - armcal identify --method; knows no other way to identify.
#pragma once

#include <string>
#include <vector>

#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct MethodOptions {
  std::string robot, method, channels, test, json;
  std::vector<std::string> train;
  double band_Hz = 0, cutoff_Hz = 0;
  nlohmann::ordered_json exogeneity;  // the test that chose the method, for the JSON; null: it was asked for
};

// kOk, or kPartial where the method says that it did not converge. Throws io::InputError: unknown method, or a log that
// lacks what the method needs.
int RunMethod(const MethodOptions& options);

}  // namespace armcal::tool
