// tool - armcal diagnose --batch and --splits: what they share on the command line; --batch: the logs of many arms.
#pragma once

#include <string>
#include <vector>

#include "host_sim/tool/diagnose.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct BatchOptions {
  std::string folder, out, part;
  std::vector<std::string> summary, splits;
  int jobs = 0;
  bool asked() const { return !folder.empty() || !summary.empty() || !splits.empty(); }
};

void AddBatchOptions(CLI::App& verb, BatchOptions& options);

// kOk, or kPartial where a log has no verdict; the summary has a line for each such log. Throws io::InputError: an
// option is missing or in vain, or there is nothing to diagnose.
int RunBatch(const DiagnoseOptions& one, const BatchOptions& batch);

}  // namespace armcal::tool
