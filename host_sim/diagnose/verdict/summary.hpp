// verdict - sums up many verdicts as text, JSON and page.
#pragma once

#include <filesystem>
#include <string>

#include "host_sim/diagnose/verdict/verdict_file.hpp"

namespace armcal::verdict {

// By name and by kind; nothing in it depends on when or where a verdict was made.
nlohmann::ordered_json SummaryJson(const Verdicts& verdicts);
std::string SummaryText(const nlohmann::ordered_json& summary);
void WriteSummaryPage(const std::filesystem::path& path, const nlohmann::ordered_json& summary);

}  // namespace armcal::verdict
