// python - the parts of the module: logs, what is computed from them, and motions.
#pragma once

#include <nanobind/nanobind.h>

#include <nlohmann/json.hpp>

namespace armcal::python {

void BindLogs(nanobind::module_& m);
void BindAnalyses(nanobind::module_& m);
void BindExcite(nanobind::module_& m);

nanobind::object ToDict(const nlohmann::ordered_json& json);

}  // namespace armcal::python
