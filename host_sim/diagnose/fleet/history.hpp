// fleet - how an arm's friction, payload and errors went over its logs, and which tables its drive got.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/diagnose/fleet/store.hpp"

namespace armcal::fleet {

struct Point {
  std::size_t log = 0;  // number of the entry
  double value = 0, sd = 0;
};

// One quantity over the logs that have it.
struct Course {
  std::string name, unit;
  std::vector<Point> point;
};

struct Change {
  std::size_t log = 0;  // the first entry that is different
  std::string name, unit;
  double before = 0, after = 0;  // before: the mean since the change before this one; NaN: `name` says all
};

// A table that the drive got, or a reading of its health.
struct Event {
  std::string date, what;
  nlohmann::ordered_json json;
};

struct History {
  std::vector<Entry> entry;        // without those that failed
  int failed = 0;                  // so many
  std::vector<std::string> terms;  // of each entry: what was confirmed
  std::vector<Course> course;      // declared parameters, payload, error of each joint on the held-out log
  std::vector<Change> change;      // by log
  std::vector<Event> event;        // by date
};

// A change is a value that is off the mean of those before it by more than four standard deviations, which count the
// value's own, those of the values before and their scatter, and by more than a tenth (errors: a quarter). After a
// change the mean begins anew. A term that comes or goes is a change, too.
// InputError: an entry is none of its kind.
History HistoryOf(const std::vector<Entry>& verdicts, const std::vector<Entry>& tables = {},
                  const std::vector<Entry>& readings = {});

std::string HistoryText(const History& history);
nlohmann::ordered_json HistoryJson(const History& history);
void WriteHistoryPage(const std::filesystem::path& path, const std::string& arm, const History& history);

}  // namespace armcal::fleet
