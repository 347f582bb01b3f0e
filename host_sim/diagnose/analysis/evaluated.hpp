// analysis - the torque error of given parameters on logs; nothing is fitted.
#pragma once

#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/given.hpp"

namespace armcal::analysis {

struct Evaluated {
  std::vector<verdict::HeldOutError> each;        // of every log
  std::optional<verdict::HeldOutError> together;  // of all logs as one record, where there are several
  nlohmann::ordered_json json;                    // {"logs": [...], "together"}
};

// band_Hz: also below this frequency; 0: not.
Evaluated Evaluate(const codegen::Model& model, const calibration::Given& given,
                   const std::vector<calibration::Dataset>& logs, double band_Hz);

}  // namespace armcal::analysis
