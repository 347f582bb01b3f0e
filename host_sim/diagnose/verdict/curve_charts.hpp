// verdict - makes charts of the curves that a JSON holds.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/data/report/live.hpp"

namespace armcal::verdict {

// A prediction as CurvesOf has it, and how a chart shows it.
struct ShownPrediction {
  std::string key, predicted, left;  // predicted, left: what a legend calls it and what it leaves
  report::Style style = report::Style::kLine;
  int colour = 0;
};

// Torque over time and spectra of what predictions leave, a panel for each joint of json["curves"]. shown: joints from
// 1 that a reader sees first. Frequencies above `looked_at_to_Hz` are greyed.
report::Live TorqueCharts(const nlohmann::ordered_json& json, const std::vector<ShownPrediction>& predictions,
                          const std::vector<int>& shown);
report::Live SpectrumCharts(const nlohmann::ordered_json& json, const std::vector<ShownPrediction>& predictions,
                            const std::vector<int>& shown);

}  // namespace armcal::verdict
