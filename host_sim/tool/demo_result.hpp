// tool - tells what a demo found: the last screen, and the page. Both read the demo's JSON alone.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace armcal::tool {

std::string DemoText(const nlohmann::ordered_json& r);
void WriteDemoPage(const std::filesystem::path& path, const nlohmann::ordered_json& r);

}  // namespace armcal::tool
