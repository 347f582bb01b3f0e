// verdict - shows what a JSON holds: its numbers, and charts of its curves.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/data/report/live.hpp"

namespace armcal::verdict {

// A number of a JSON, and those of an array; NaN for null and for what is not finite.
double NumberOf(const nlohmann::ordered_json& value);
std::vector<double> Numbers(const nlohmann::ordered_json& array);

// "0.812 to 0.934": a value with a standard deviation, normally distributed; "-" without a deviation.
std::string Interval95(double value, double sd);

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

// "joint 2", or "joint 2, elbow" where the robot file has a name of its own. joint: from 1.
std::string JointTitle(const nlohmann::ordered_json& json, int joint);

}  // namespace armcal::verdict
