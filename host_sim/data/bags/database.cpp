// bags - reads the SQLite database of rosbag2.
#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "host_sim/data/bags/container.hpp"
#include "host_sim/data/files/sqlite.hpp"

namespace armcal::bags {

namespace {

class Database {
 public:
  Database(const std::string& path, Bytes file) {
    sqlite3* made = nullptr;
    // A database that its writer has closed is read as it lies; one with a journal beside it needs the journal.
    const auto has = [&path](const char* end) {
      std::error_code none;
      return std::filesystem::exists(path + end, none) && !std::filesystem::is_empty(path + end, none);
    };
    const bool journal = has("-wal") || has("-journal");
    const std::string name = path.empty() ? ":memory:" : "file:" + Escaped(path) + (journal ? "" : "?immutable=1");
    const int access = path.empty() ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY | SQLITE_OPEN_URI;
    const int code = sqlite3_open_v2(name.c_str(), &made, access, nullptr);
    database_.reset(made);
    if (code != SQLITE_OK) Fail();
    if (path.empty()) {
      unpacked_ = Bytes(file);
      // SQLite reads no database in memory whose header says that it has a write-ahead log: bytes 18 and 19 are 2.
      constexpr std::size_t kVersions = 18;
      if (unpacked_.size() > kVersions + 1) unpacked_[kVersions] = unpacked_[kVersions + 1] = 1;
      const auto size = static_cast<sqlite3_int64>(unpacked_.size());
      if (sqlite3_deserialize(made, "main", reinterpret_cast<unsigned char*>(unpacked_.data()), size, size,
                              SQLITE_DESERIALIZE_READONLY) != SQLITE_OK)
        Fail();
    }
    sqlite3_db_config(made, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(made, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  }

  // Calls `row` for each row of the answer.
  template <class Row>
  void Ask(const std::string& question, Row row) const {
    if (!files::Ask(database_.get(), question, {}, row)) Fail();
  }

  // A plain table: a view or a virtual table could compute for ever.
  bool HasTable(const std::string& name) const {
    bool has = false;
    Ask("SELECT 1 FROM sqlite_master WHERE type = 'table' AND rootpage > 0 AND name = '" + name + "'",
        [&has](sqlite3_stmt*) { has = true; });
    return has;
  }

 private:
  static std::string Escaped(const std::string& path) {
    std::string out;
    for (const char c : path) {
      if (c == '?' || c == '#' || c == '%') out += fmt::format("%{:02x}", c);
      else out += c;
    }
    return out;
  }

  [[noreturn]] void Fail() const {
    throw io::InputError(fmt::format("is damaged or cannot be read as a database ({})",
                                     database_ ? sqlite3_errmsg(database_.get()) : "no memory"));
  }

  std::string unpacked_;  // outlives the database
  files::Sqlite database_;
};

Bytes BytesOf(sqlite3_stmt* row, int column) {
  const void* bytes = sqlite3_column_blob(row, column);
  const int size = sqlite3_column_bytes(row, column);
  return bytes == nullptr ? Bytes{} : Bytes(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
}

std::string TextOf(sqlite3_stmt* row, int column) { return std::string(BytesOf(row, column)); }

}  // namespace

bool IsDatabase(Bytes file) { return file.starts_with(Bytes("SQLite format 3\0", 16)); }

void ReadDatabase(const std::string& path, Bytes file, const Taker& taker) {
  const Database database(path, file);
  for (const char* table : {"topics", "messages"})
    if (!database.HasTable(table))
      throw io::InputError(fmt::format("has no table '{}', expected a bag of rosbag2", table));
  std::map<std::string, std::pair<std::string, std::string>> definition;  // by type: how it is written, and the text
  if (database.HasTable("message_definitions"))
    database.Ask("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
                 [&](sqlite3_stmt* row) {
                   definition[TextOf(row, 0)] = {TextOf(row, 1), TextOf(row, 2)};
                 });
  std::map<std::int64_t, Topic> wanted;
  database.Ask("SELECT id, name, type, serialization_format FROM topics", [&](sqlite3_stmt* row) {
    Topic topic{TextOf(row, 1), TextOf(row, 3), TextOf(row, 2), {}, {}};
    if (const auto own = definition.find(topic.type); own != definition.end() && !own->second.second.empty())
      topic.schema = own->second.first, topic.definition = own->second.second;
    if (taker.wants(topic)) wanted.emplace(sqlite3_column_int64(row, 0), std::move(topic));
  });
  database.Ask("SELECT topic_id, timestamp, data FROM messages ORDER BY id", [&](sqlite3_stmt* row) {
    const auto topic = wanted.find(sqlite3_column_int64(row, 0));
    if (topic != wanted.end()) taker.take(topic->second, {sqlite3_column_int64(row, 1), BytesOf(row, 2)});
  });
}

}  // namespace armcal::bags
