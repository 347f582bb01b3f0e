// cli - many verdicts as one: text, JSON, page; knows verdict files, no log.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace armcal::cli {

// What one log came to: the file that armcal diagnose --json writes, or why there is none.
struct Verdict {
  std::string name;
  nlohmann::ordered_json json;
  bool failed() const { return json["verdict"] == "failed"; }
};

// {"verdict": "failed", "error": why}, what a log without a verdict leaves behind.
nlohmann::ordered_json FailedVerdict(const std::string& why);

// NAME.json; its name is NAME. A file that holds no verdict is a failed one that says so.
Verdict ReadVerdict(const std::filesystem::path& path);

// Every NAME.json of folders, and files as they are, by name. InputError: no such file, two of one name, none at all.
std::vector<Verdict> ReadVerdicts(const std::vector<std::string>& paths);

// By name and by kind; nothing in it depends on when or where a verdict was made.
nlohmann::ordered_json SummaryJson(const std::vector<Verdict>& verdicts);
std::string SummaryText(const nlohmann::ordered_json& summary);
void WriteSummaryPage(const std::filesystem::path& path, const nlohmann::ordered_json& summary);

}  // namespace armcal::cli
