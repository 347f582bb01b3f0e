// fleet - keeps the verdicts, tables and health readings of many arms in one SQLite file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace armcal::fleet {

enum class Kind { kVerdict, kTable, kHealth };

struct Entry {
  std::string arm;
  std::string date;  // of the log, the change of the table or the reading: "2026-03-01T12:00:00Z"
  // SHA-256 of the held-out log of a verdict, or its name where it cannot be read. CRC of the table of the others.
  std::string hash;
  std::string json;     // as the verb's --json writes it; a table has its words, too
  bool failed = false;  // a run that failed: an entry that is there stays
};

// All of them or none, on the disk when the call returns. A verdict of the same arm and log is replaced, another entry
// of the same arm, date and table. Processes may write at once: each waits for the others. Without entries the database
// is tried, and made if it is not there. Throws io::InputError: not a database of armcal, or it cannot be written.
void Keep(const std::filesystem::path& database, Kind kind, const std::vector<Entry>& entries);

// The entries of an arm, the oldest first.
std::vector<Entry> EntriesOf(const std::filesystem::path& database, Kind kind, const std::string& arm);
// The arms of which there is anything, by name.
std::vector<std::string> ArmsOf(const std::filesystem::path& database);

}  // namespace armcal::fleet
