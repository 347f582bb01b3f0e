// python - the parts of the module: logs, and what is computed from them.
#pragma once

#include <nanobind/nanobind.h>

namespace armcal::python {

void BindLogs(nanobind::module_& m);
void BindAnalyses(nanobind::module_& m);

}  // namespace armcal::python
