// tool - the demo's figures and its page; knows no stage.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "host_sim/tool/diagnose.hpp"

namespace armcal::tool {

// RMS per joint of measured torque minus what the sensor would have read without noise, over the scored moving samples
// of a recorded log. truth: the drive's truth log; first_tick, decimation: as the recording says.
Eigen::VectorXd PlantFloor(const std::string& truth, const calibration::Dataset& log, std::uint32_t first_tick,
                           int decimation);

// The last screen and the page. result: the demo's JSON.
std::string DemoText(const nlohmann::ordered_json& result);
void WriteDemoPage(const std::string& path, const nlohmann::ordered_json& result, const verdict::DiagnosisView& view);

}  // namespace armcal::tool
