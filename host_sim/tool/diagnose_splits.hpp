// tool - armcal diagnose --splits: every run of one arm held out once; knows no search.
#pragma once

#include "host_sim/tool/diagnose_batch.hpp"

namespace armcal::tool {

// kOk, or kPartial where a split has no verdict. Throws io::InputError: fewer than two groups of runs, or two runs of
// one name.
int RunSplits(const DiagnoseOptions& one, const BatchOptions& options);

}  // namespace armcal::tool
