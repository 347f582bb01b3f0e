// logs - proposes a channel map for a log, from the names of its columns and from its numbers.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/logs/look.hpp"

namespace armcal::logs {

struct Proposal {
  std::string map;                      // a channel map (TOML); what is not certain is marked with "guess"
  std::vector<std::string> recognised;  // "q", "tau" ...
  std::vector<std::string> missing;     // of q and tau, which a log must have
};

// `source` and `definitions` are written into the map.
Proposal Recognise(const Look& look, const std::string& source, const std::vector<std::string>& definitions);

}  // namespace armcal::logs
