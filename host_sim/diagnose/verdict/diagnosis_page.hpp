// verdict - shows one diagnosis on a page. It reads the diagnosis' JSON alone, so a page can be made again from a file.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "host_sim/data/report/page.hpp"

namespace armcal::verdict {

// Verdict, error before and after, and what to do; then the curves, the causes, the parameters, what was not looked at.
// json: as DiagnosisJson gives it. nlohmann::ordered_json::exception: it lacks something.
void AddDiagnosis(report::Page& page, const nlohmann::ordered_json& json);

// The whole page. json: as `armcal diagnose --json` writes it.
void WriteDiagnosisPage(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace armcal::verdict
