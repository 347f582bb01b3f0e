// files - owns an SQLite database and asks it. Only files that are built with SQLite include this.
#pragma once

#include <sqlite3.h>

#include <memory>
#include <string>
#include <vector>

namespace armcal::files {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
using Sqlite = std::unique_ptr<sqlite3, CloseDatabase>;

// Calls row(statement) for each row of the answer. values take the place of the question's "?". False: SQLite refused
// or broke off, and sqlite3_errmsg says why.
template <class Row>
bool Ask(sqlite3* database, const std::string& question, const std::vector<std::string>& values, Row row) {
  struct End {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  sqlite3_stmt* made = nullptr;
  if (sqlite3_prepare_v2(database, question.c_str(), -1, &made, nullptr) != SQLITE_OK) return false;
  const std::unique_ptr<sqlite3_stmt, End> statement(made);
  for (std::size_t k = 0; k < values.size(); ++k)
    sqlite3_bind_text(made, static_cast<int>(k) + 1, values[k].c_str(), static_cast<int>(values[k].size()),
                      SQLITE_TRANSIENT);
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(made)) == SQLITE_ROW) row(made);
  return code == SQLITE_DONE;
}

}  // namespace armcal::files
