// fleet - keeps the verdicts of many arms in one SQLite file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace armcal::fleet {

struct Entry {
  std::string arm;
  std::string date;  // of the log: "2026-03-01T12:00:00Z"
  std::string log;   // SHA-256 of the held-out log; its name where the log cannot be read
  std::string json;  // the verdict, as armcal diagnose --json writes it
};

// All of them or none, on the disk when the call returns. An entry of the same arm and log is replaced. Processes may
// write at once: each waits for the others. Throws io::InputError: not a database of armcal, or it cannot be written.
void Keep(const std::filesystem::path& database, const std::vector<Entry>& entries);

// The entries of an arm, the oldest first.
std::vector<Entry> EntriesOf(const std::filesystem::path& database, const std::string& arm);
std::vector<std::string> ArmsOf(const std::filesystem::path& database);

}  // namespace armcal::fleet
