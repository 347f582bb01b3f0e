// tool - armcal identify --with --without: gains of the drives, or the load at the flange; knows no other way to
// identify.
#pragma once

#include <string>
#include <vector>

#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct PayloadOptions {
  std::string robot, channels, payload, payload_out, table, json;
  std::vector<std::string> with, without;
  double cutoff_Hz = 0;
  bool asked() const { return !with.empty() || !without.empty() || !payload.empty() || !payload_out.empty(); }
};

void AddPayloadOptions(CLI::App& verb, PayloadOptions& options);

// kOk, or kPartial where the logs do not determine every gain. Throws io::InputError: an option is missing or in vain,
// no load is seen, or a log cannot be one of this arm.
int RunPayload(const PayloadOptions& options);

}  // namespace armcal::tool
