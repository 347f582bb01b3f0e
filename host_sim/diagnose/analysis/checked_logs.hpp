// analysis - checks logs against the model and makes them ready to be fitted.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_sim/data/logs/log.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::analysis {

// Takes what a user should read about a log, a line at a time.
using Say = std::function<void(const std::string&)>;

// logs: at least one. cutoff_Hz: of the derived speeds and accelerations; 0: chosen for each log. A log that is too
// short is left out where there are others. InputError: a log cannot be one of this arm, or none is long enough.
std::vector<calibration::Dataset> CheckedLogs(const codegen::Model& model, const std::vector<logs::Log>& logs,
                                              double cutoff_Hz, const Say& say);

// The logs of CheckedLogs with speed and acceleration of a lower bandwidth.
std::vector<calibration::Dataset> NarrowLogs(const codegen::Model& model, const std::vector<logs::Log>& logs,
                                             double cutoff_Hz);

// Which faults of the columns nobody can see where the robot file has no link data, a line each.
std::vector<std::string> Untold(const codegen::Model& model, const std::vector<calibration::Dataset>& data);

}  // namespace armcal::analysis
