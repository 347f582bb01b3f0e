// verdict - shows an identified model on a page. It reads the JSON alone.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

namespace armcal::verdict {

// Error of each joint, what to do, measured and predicted torque, spectra, parameters with intervals. json: as
// `armcal identify --json` writes it. nlohmann::ordered_json::exception: it lacks something.
void WriteIdentificationPage(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace armcal::verdict
