// tool - runs one diagnosis from files to files, or a batch of them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host_sim/diagnose/analysis/diagnosed.hpp"
#include "host_sim/tool/fleet.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct DiagnoseOptions {
  std::string robot, test, json, report, model_out;
  LogFormat format;
  FleetOptions fleet;
  std::vector<std::string> train;
  analysis::DiagnoseOptions how = {};
};

// Train, decide, write the model file and take its hash; only then open the held-out log. Prints the verdict. The JSON
// is written last: who finds it finds the other files and the whole output, too.
std::unique_ptr<analysis::Diagnosed> RunDiagnosis(const DiagnoseOptions& options);

// --batch: the logs of many arms. --splits: every run of one arm held out once. (diagnose_batch.cpp)
struct BatchOptions {
  std::string folder, out, part;
  std::vector<std::string> summary, splits;
  int jobs = 0;
  bool resume = false;
  bool asked() const { return !folder.empty() || !summary.empty() || !splits.empty(); }
};

void AddBatchOptions(CLI::App& verb, BatchOptions& options);

// kOk, or kPartial where a log has no verdict; the summary has a line for each such log. Throws io::InputError: an
// option is missing or in vain, or there is nothing to diagnose.
int RunBatch(const DiagnoseOptions& one, const BatchOptions& batch);

}  // namespace armcal::tool
