// verdict - many verdicts as one: text, JSON, page; knows verdict files, no log.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace armcal::verdict {

// By name of the log: what it came to, as armcal diagnose --json writes it, or why there is nothing.
using Verdicts = std::map<std::string, nlohmann::ordered_json>;

// {"verdict": "failed", "error": why}, what a log without a verdict leaves behind.
nlohmann::ordered_json FailedVerdict(const std::string& why);

// A term's joint as a verdict has it: a number, or words as "5-6".
std::string JointText(const nlohmann::ordered_json& joint);

// A file that holds no verdict is a failed one that says so.
nlohmann::ordered_json ReadVerdict(const std::filesystem::path& path);

// Every NAME.json of folders, and files as they are. InputError: no such file, or two of one name.
Verdicts ReadVerdicts(const std::vector<std::string>& paths);

// By name and by kind; nothing in it depends on when or where a verdict was made.
nlohmann::ordered_json SummaryJson(const Verdicts& verdicts);
std::string SummaryText(const nlohmann::ordered_json& summary);
void WriteSummaryPage(const std::filesystem::path& path, const nlohmann::ordered_json& summary);

}  // namespace armcal::verdict
