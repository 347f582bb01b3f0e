// fleet - one transaction for each call; SQLite's rollback journal undoes what a killed process left. No write-ahead
// log: it does not work over a network's file system, where a cluster's jobs meet.
#include "host_sim/diagnose/fleet/store.hpp"

#include <set>

#include "codegen/src/io/require_file.hpp"
#include "host_sim/data/files/sqlite.hpp"

namespace armcal::fleet {
namespace {

namespace fs = std::filesystem;

constexpr int kPatience_ms = 60000;       // for other writers
constexpr int kApplication = 0x61726D63;  // "armc": says whose database it is
constexpr int kLayout = 1;

// Where the entries of a kind are. A database may lack a sheet to which nobody wrote.
struct Sheet {
  std::string name, hash, key;
};

Sheet SheetOf(Kind kind) {
  switch (kind) {
    case Kind::kVerdict:
      return {"verdict", "log", "arm, log"};
    case Kind::kTable:
      return {"drive_table", "crc", "arm, date, crc"};
    case Kind::kHealth:
      break;
  }
  return {"health", "crc", "arm, date, crc"};
}

class Store {
 public:
  Store(const fs::path& path, int access) : path_(path) {
    sqlite3* made = nullptr;
    const int code = sqlite3_open_v2(path.c_str(), &made, access, nullptr);
    database_.reset(made);
    if (code != SQLITE_OK) Fail();
    sqlite3_busy_timeout(made, kPatience_ms);
  }

  // Calls row(query) for each row of the answer.
  template <class Row>
  void Ask(const std::string& question, const std::vector<std::string>& values, Row row) {
    if (!files::Ask(database_.get(), question, values, row)) Fail();
  }
  void Do(const std::string& command, const std::vector<std::string>& values = {}) {
    Ask(command, values, [](sqlite3_stmt*) {});
  }
  int Number(const std::string& question) {
    int number = 0;
    Ask(question, {}, [&](sqlite3_stmt* row) { number = sqlite3_column_int(row, 0); });
    return number;
  }
  bool Has(const Sheet& sheet) {
    return Number("SELECT count(*) FROM sqlite_master WHERE name = '" + sheet.name + "'") > 0;
  }
  // Ours, or still empty.
  void Check() {
    const bool empty = Number("SELECT count(*) FROM sqlite_master") == 0;
    if (!empty && (Number("PRAGMA application_id") != kApplication || Number("PRAGMA user_version") != kLayout))
      throw io::InputError(path_.string() + ": is no database of armcal, expected one that armcal diagnose --db made");
  }

 private:
  [[noreturn]] void Fail() const {
    throw io::InputError(path_.string() + ": " + sqlite3_errmsg(database_.get()) +
                         "; expected a database that armcal diagnose --db made");
  }

  fs::path path_;
  files::Sqlite database_;
};

Store Opened(const fs::path& path) {
  io::RequireFile(path);
  Store store(path, SQLITE_OPEN_READWRITE);  // reading may have to undo what a killed writer left
  store.Check();
  return store;
}

std::string TextOf(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(row, column))) : std::string();
}

}  // namespace

void Keep(const fs::path& database, Kind kind, const std::vector<Entry>& entries) {
  const Sheet sheet = SheetOf(kind);
  Store store(database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  store.Do("BEGIN IMMEDIATE");
  store.Check();
  store.Do("PRAGMA application_id = " + std::to_string(kApplication));
  store.Do("PRAGMA user_version = " + std::to_string(kLayout));
  store.Do("CREATE TABLE IF NOT EXISTS " + sheet.name + " (arm TEXT NOT NULL, date TEXT NOT NULL, " + sheet.hash +
           " TEXT NOT NULL, json TEXT NOT NULL, PRIMARY KEY (" + sheet.key + "))");
  for (const Entry& e : entries)
    store.Do(std::string("INSERT OR ") + (e.failed ? "IGNORE" : "REPLACE") + " INTO " + sheet.name + " (arm, date, " +
                 sheet.hash + ", json) VALUES (?, ?, ?, ?)",
             {e.arm, e.date, e.hash, e.json});
  store.Do("COMMIT");
}

std::vector<Entry> EntriesOf(const fs::path& database, Kind kind, const std::string& arm) {
  const Sheet sheet = SheetOf(kind);
  std::vector<Entry> entries;
  Store store = Opened(database);
  if (store.Has(sheet))
    store.Ask(
        "SELECT arm, date, " + sheet.hash + ", json FROM " + sheet.name + " WHERE arm = ? ORDER BY date, " + sheet.hash,
        {arm}, [&](sqlite3_stmt* row) {
          entries.push_back({TextOf(row, 0), TextOf(row, 1), TextOf(row, 2), TextOf(row, 3)});
        });
  return entries;
}

std::vector<std::string> ArmsOf(const fs::path& database) {
  std::set<std::string> arms;
  Store store = Opened(database);
  for (const Kind kind : {Kind::kVerdict, Kind::kTable, Kind::kHealth})
    if (const Sheet sheet = SheetOf(kind); store.Has(sheet))
      store.Ask("SELECT DISTINCT arm FROM " + sheet.name, {}, [&](sqlite3_stmt* row) { arms.insert(TextOf(row, 0)); });
  return {arms.begin(), arms.end()};
}

}  // namespace armcal::fleet
