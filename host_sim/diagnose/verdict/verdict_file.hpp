// verdict - reads files that should hold a verdict.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace armcal::verdict {

// Verdicts by the name of their log, as armcal diagnose --json writes them, or the reason why there is none.
using Verdicts = std::map<std::string, nlohmann::ordered_json>;

// {"verdict": "failed", "error": why}, what a log without a verdict leaves behind.
nlohmann::ordered_json FailedVerdict(const std::string& why);
bool Failed(const nlohmann::ordered_json& verdict);

// A term's joint as a verdict has it: a number, or words as "5-6".
std::string JointText(const nlohmann::ordered_json& joint);

// A file that holds no verdict is a failed one that says so.
nlohmann::ordered_json ReadVerdict(const std::filesystem::path& path);

// Every NAME.json of folders, and files as they are. InputError: no such file, or two of one name.
Verdicts ReadVerdicts(const std::vector<std::string>& paths);

}  // namespace armcal::verdict
