// verdict - sums up many verdicts as text, JSON and page.
#pragma once

#include <filesystem>
#include <string>

#include "host_sim/diagnose/verdict/verdict_file.hpp"

namespace armcal::verdict {

// By name and by kind; nothing in it depends on when or where a verdict was made.
nlohmann::ordered_json SummaryJson(const Verdicts& verdicts);
std::string SummaryText(const nlohmann::ordered_json& summary);
// pages: the folder with the logs' own pages, NAME.html; empty: the page's own. Logs with a page are links to it.
void WriteSummaryPage(const std::filesystem::path& path, const nlohmann::ordered_json& summary,
                      const std::filesystem::path& pages = {});

}  // namespace armcal::verdict
