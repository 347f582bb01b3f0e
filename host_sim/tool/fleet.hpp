// tool - keeps verdicts in a database, where a verb was asked to.
#pragma once

#include <map>
#include <string>

#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct FleetOptions {
  std::string database, date;
};

// Adds --db and --date.
void AddFleetOptions(CLI::App& verb, FleetOptions& o);

// Nothing without --db. The names of the verdicts are those of the arms. log: held-out logs by arm; for others the
// verdict names its own. Prints how many are safe.
void KeepVerdicts(const FleetOptions& o, const verdict::Verdicts& verdicts,
                  const std::map<std::string, std::string>& log = {});

}  // namespace armcal::tool
