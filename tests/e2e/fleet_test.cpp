// end-to-end tests - a database that many write to and that some do not survive, what it keeps, and the history that it
// gives.
#include <fcntl.h>
#include <signal.h>
#include <sqlite3.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <random>

#include "codegen/src/generator/load.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kWriters = 8, kKills = 50, kArms = 25;

// A verdict as armcal diagnose --json writes it, as far as a summary and a history need it.
void WriteVerdict(const fs::path& path, double friction, int round) {
  nlohmann::ordered_json j{{"verdict", "none"}, {"terms", nlohmann::json::array()}, {"round", round}};
  j["before_moving"] = j["after_moving"] = {1.0, 2.0};
  j["declared_parameters"] = {{{"name", "Fc1"}, {"unit", "N*m"}, {"value", friction}, {"sd", 0.1}}};
  j["payload"] = nullptr;
  j["padding"] = std::string(20000, 'x');  // several pages of the database
  std::ofstream(path) << j.dump();
}

// Round of each arm, read by SQLite itself. Fails where a row is no whole verdict, or where there are two of one arm.
std::map<std::string, int> RoundsIn(const fs::path& database) {
  std::map<std::string, int> rounds;
  sqlite3* open = nullptr;
  EXPECT_EQ(sqlite3_open(database.c_str(), &open), SQLITE_OK);
  sqlite3_busy_timeout(open, 60000);
  sqlite3_stmt* rows = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(open, "PRAGMA integrity_check", -1, &rows, nullptr), SQLITE_OK) << sqlite3_errmsg(open);
  EXPECT_EQ(sqlite3_step(rows), SQLITE_ROW);
  EXPECT_STREQ(reinterpret_cast<const char*>(sqlite3_column_text(rows, 0)), "ok");
  sqlite3_finalize(rows);
  if (sqlite3_prepare_v2(open, "SELECT arm, json FROM verdict", -1, &rows, nullptr) == SQLITE_OK)
    while (sqlite3_step(rows) == SQLITE_ROW) {
      const std::string arm = reinterpret_cast<const char*>(sqlite3_column_text(rows, 0));
      const auto verdict = nlohmann::json::parse(reinterpret_cast<const char*>(sqlite3_column_text(rows, 1)));
      EXPECT_EQ(verdict.at("padding").get<std::string>().size(), 20000U);
      EXPECT_TRUE(rounds.emplace(arm, verdict.at("round").get<int>()).second) << arm;
    }
  sqlite3_finalize(rows);
  sqlite3_close(open);
  return rounds;
}

TEST(LongFleet, EightWritersOfWhichFiftyAreKilled_LoseNoVerdictAndLeaveNoneHalf) {
  const fs::path folder = FreshFolder("fleet"), database = folder / "fleet.sqlite";
  const auto arm = [](int writer, int k) { return "arm_" + std::to_string(writer) + "_" + std::to_string(k); };
  for (int w = 0; w < kWriters; ++w) fs::create_directories(folder / std::to_string(w));
  std::mt19937 random(1);
  int killed = 0, safe[kWriters] = {};  // safe: the last round that a writer said is kept
  for (int round = 1; killed < kKills; ++round) {
    ASSERT_LT(round, 10 * kKills);
    std::vector<pid_t> child;
    std::vector<int> out;
    for (int w = 0; w < kWriters; ++w) {
      for (int k = 0; k < kArms; ++k) WriteVerdict(folder / std::to_string(w) / (arm(w, k) + ".json"), 10, round);
      out.push_back(open((folder / ("out_" + std::to_string(w))).c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644));
      child.push_back(Start({ARMCAL_TOOL, "diagnose", "--summary", (folder / std::to_string(w)).string(), "--db",
                             database.string(), "--date", "2026-01-01"},
                            out.back(), out.back()));
    }
    const int victims = std::min(4, kKills - killed);
    for (int k = 0; k < victims; ++k) {
      usleep(std::uniform_int_distribution<useconds_t>(0, 60000)(random));
      kill(child[static_cast<std::size_t>(2 * k)], SIGKILL);
    }
    for (int w = 0; w < kWriters; ++w) {
      const int code = WaitFor(child[static_cast<std::size_t>(w)]);
      close(out[static_cast<std::size_t>(w)]);
      const bool was_killed = code == 128 + SIGKILL;
      killed += was_killed;
      const std::string said = ReadText(folder / ("out_" + std::to_string(w)));
      EXPECT_EQ(code, was_killed ? 128 + SIGKILL : 0) << said;
      if (said.find("kept in") != std::string::npos) safe[w] = round;
    }
    const std::map<std::string, int> kept = RoundsIn(database);
    for (int w = 0; w < kWriters; ++w)
      for (int k = 0; k < kArms; ++k) {
        const auto found = kept.find(arm(w, k));
        const int its = found == kept.end() ? 0 : found->second;
        ASSERT_GE(its, safe[w]) << "lost: " << arm(w, k) << ", round " << round;
        const auto first = kept.find(arm(w, 0));
        ASSERT_EQ(its, first == kept.end() ? 0 : first->second) << "half of a writer's verdicts, round " << round;
      }
  }
  EXPECT_EQ(killed, kKills);
  EXPECT_EQ(RoundsIn(database).size(), static_cast<std::size_t>(kWriters * kArms));
}

TEST(Fleet, HistoryNamesAPlantedChange_AtItsLog) {
  const fs::path folder = FreshFolder("fleet_history");
  const std::string database = (folder / "fleet.sqlite").string();
  for (int month = 1; month <= 9; ++month) {
    const bool is_bag = month % 2 == 0;  // a folder of rosbag2
    const fs::path verdicts = folder / std::to_string(month),
                   log = folder / (std::to_string(month) + (is_bag ? "_bag" : ".csv"));
    fs::create_directories(verdicts);
    if (is_bag) fs::create_directories(log);
    std::ofstream(is_bag ? log / "bag_0.mcap" : log) << month;
    for (const char* arm : {"left", "right"}) {
      const fs::path file = verdicts / (std::string(arm) + ".json");
      WriteVerdict(file, arm == std::string("left") && month >= 6 ? 14 : 10 + 0.05 * (month % 3), 0);
      nlohmann::ordered_json verdict = ReadJson(file);
      verdict["test"] = log.string();
      std::ofstream(file) << verdict.dump();
    }
    const std::vector<std::string> keep{"diagnose",
                                        "--summary",
                                        verdicts.string(),
                                        "--db",
                                        database,
                                        "--date",
                                        "2026-0" + std::to_string(month) + "-15"};
    ASSERT_EQ(Tool(keep).code, 0);
    ASSERT_EQ(Tool(keep).code, 0);  // again: the same log counts once
  }
  const std::string json = (folder / "history.json").string(), page = (folder / "history.html").string();
  const Outcome left = Tool({"history", "left", "--db", database, "--json", json, "--report", page});
  ASSERT_EQ(left.code, 0) << left.err;
  EXPECT_NE(left.out.find("2026-06-15: Fc1 from 10.06 to 14 N*m"), std::string::npos) << left.out;
  const nlohmann::json history = ReadJson(json);
  EXPECT_EQ(history.at("logs").size(), 9U);
  ASSERT_EQ(history.at("changes").size(), 1U) << history.at("changes");
  EXPECT_EQ(history["changes"][0].at("date"), "2026-06-15");
  EXPECT_NE(ReadText(page).find("Fc1"), std::string::npos);
  const Outcome right = Tool({"history", "right", "--db", database});
  EXPECT_NE(right.out.find("nothing changed"), std::string::npos) << right.out;
  ExpectOneLine(Tool({"history", "lefd", "--db", database}), 2, "the nearest is left");
  ExpectOneLine(Tool({"history", "left", "--db", (folder / "none.sqlite").string()}), 2, "no such file");
  ExpectOneLine(Tool({"history", "left", "--db", json}), 2, "is not a database");
}

TEST(Fleet, TablesAndHealthOfADrive_AreKeptWordForWord) {
  const fs::path folder = FreshFolder("fleet_drive");
  const RunningDrive drive(folder);
  const std::string database = (folder / "fleet.sqlite").string(), table = (folder / "table.toml").string(),
                    backup = (folder / "backup.json").string(), json = (folder / "history.json").string();
  const auto ask = [&](std::vector<std::string> words, const std::string& date) {
    words.insert(words.end(), {"--connect", drive.address()});
    if (!date.empty()) words.insert(words.end(), {"--db", database, "--arm", "left", "--date", date});
    return Tool(words);
  };
  calibration::TableFile made = calibration::DefaultTable(codegen::LoadModel("er20_like"));
  calibration::WriteTable(table, made);
  for (const char* unpadded : {"2026-3", "2026-03-1"})
    ExpectOneLine(ask({"health"}, unpadded), 2, "expected a date as 2026-03");
  EXPECT_EQ(ask({"flash", "--robot", "er20_like", "--table", table}, "2026-01").code, 0);
  EXPECT_EQ(ask({"backup", backup}, "").code, 0);
  made.blend_ms += 100;
  calibration::WriteTable(table, made);
  EXPECT_EQ(ask({"flash", "--robot", "er20_like", "--table", table}, "2026-02").code, 0);
  EXPECT_EQ(ask({"health"}, "2026-03").code, 6);  // nothing has moved
  EXPECT_EQ(ask({"rollback"}, "2026-04").code, 0);
  EXPECT_EQ(ask({"restore", backup}, "2026-05").code, 0);
  const Outcome history = Tool({"history", "left", "--db", database, "--json", json});
  EXPECT_NE(history.out.find("2026-03: health"), std::string::npos) << history.out << history.err;
  const nlohmann::json events = ReadJson(json).at("drive"), first = ReadJson(backup);
  ASSERT_EQ(events.size(), 5U) << events;
  const char* const by[] = {"flash", "flash", "", "rollback", "restore"};
  for (const std::size_t k : {0, 1, 3, 4}) {
    EXPECT_EQ(events[k].at("by"), by[k]);
    EXPECT_EQ(events[k].at("words") == first.at("words"), k != 1) << k;
    EXPECT_EQ(events[k].at("table_crc") == first.at("table_crc"), k != 1) << k;
    EXPECT_EQ(events[k].at("serial_number"), first.at("serial_number"));
  }
  EXPECT_EQ(events[2].at("joints").size(), 6U);
  // A database that cannot be written leaves the drive as it is.
  ExpectOneLine(Tool({"rollback", "--connect", drive.address(), "--db", backup, "--arm", "left"}), 2,
                "is not a database");
  EXPECT_EQ(ask({"diff", backup}, "").code, 0);
  EXPECT_EQ(Tool({"health", "--connect", drive.address(), "--db", database}).code, 2);  // of which arm?
}

}  // namespace
}  // namespace armcal::tests
