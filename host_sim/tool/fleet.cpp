// tool - keeps verdicts, tables and health readings in a database.
#include "host_sim/tool/fleet.hpp"

#include <fmt/core.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <ctime>

#include "codegen/src/io/json.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/diagnose/fleet/store.hpp"

namespace armcal::tool {
namespace {

// What is wrong with "2026-03", "2026-03-01" or "2026-03-01T12:00:00Z"; empty: nothing.
std::string WhyNoDate(const std::string& text) {
  int year = 0, month = 0, day = 1, hour = 0, minute = 0, second = 0, end = 0;
  const int read = std::sscanf(text.c_str(), "%4d-%2d%n-%2d%nT%2d:%2d:%2dZ%n", &year, &month, &end, &day, &end, &hour,
                               &minute, &second, &end);
  const bool whole = (read == 2 || read == 3 || read == 6) && static_cast<std::size_t>(end) == text.size();
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  // Dates are sorted as text, so each number has all its digits.
  const bool padded = text.find_first_not_of("0123456789-T:Z") == std::string::npos &&
                      (text.size() == 7 || text.size() == 10 || text.size() == 20);
  if (whole && padded && month > 0 && day > 0 && date.ok() && hour < 24 && minute < 60 && second < 60) return "";
  return text + ": expected a date as 2026-03, 2026-03-01 or 2026-03-01T12:00:00Z";
}

std::string Utc(std::time_t time) {
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::time_t ChangeTime(const std::string& path) {
  struct stat file {};
  return stat(path.c_str(), &file) == 0 ? file.st_mtime : std::time(nullptr);
}

void KeepOfDrive(const FleetOptions& o, client::DriveClient& drive, fleet::Kind kind, nlohmann::ordered_json json) {
  const client::Identity id = drive.ReadIdentity();
  json["serial_number"] = id.serial_number, json["schema"] = client::CrcText(id.schema);
  const std::string date = o.date.empty() ? Utc(std::time(nullptr)) : o.date,
                    crc = client::CrcText(drive.ReadStatus().active_crc);
  fleet::Keep(o.database, kind, {{o.arm, date, crc, io::JsonText(json)}});
  fmt::print("kept in {}: {}\n", o.database, kind == fleet::Kind::kTable ? "a table" : "a health reading");
}

}  // namespace

void KeepVerdicts(const FleetOptions& o, const verdict::Verdicts& verdicts,
                  const std::map<std::string, std::string>& log) {
  if (o.database.empty()) return;
  std::vector<fleet::Entry> entries;
  for (const auto& [arm, verdict] : verdicts) {
    const auto named = log.find(arm);
    const std::string path = named != log.end() ? named->second : verdict.value("test", std::string());
    fleet::Entry e{arm, o.date, path.empty() ? arm : path, io::JsonText(verdict),  // the name where the log is not here
                   verdict::Failed(verdict)};
    if (std::filesystem::exists(path)) {  // a file, or a bag's folder
      e.hash = files::FileHash(path);
      if (e.date.empty()) e.date = Utc(ChangeTime(path));
    }
    if (e.date.empty()) e.date = Utc(std::time(nullptr));
    entries.push_back(e);
  }
  fleet::Keep(o.database, fleet::Kind::kVerdict, entries);
  fmt::print("kept in {}: {} verdicts\n", o.database, entries.size());
  std::fflush(stdout);  // who kills this process may rely on the line
}

void TryFleet(const FleetOptions& o) {
  if (!o.database.empty()) fleet::Keep(o.database, fleet::Kind::kTable, {});
}

void KeepTable(const FleetOptions& o, client::DriveClient& drive, const std::string& by,
               const nlohmann::ordered_json& told, const std::string& file) {
  if (o.database.empty()) return;
  nlohmann::ordered_json json{{"by", by}};
  json.update(told);
  if (!file.empty()) json["file"] = file, json["sha256"] = files::FileHash(file);
  json["words"] = client::ReadActiveTable(drive);
  KeepOfDrive(o, drive, fleet::Kind::kTable, json);
}

void KeepHealth(const FleetOptions& o, client::DriveClient& drive, const nlohmann::ordered_json& told) {
  if (!o.database.empty()) KeepOfDrive(o, drive, fleet::Kind::kHealth, told);
}

void AddFleetOptions(CLI::App& verb, FleetOptions& o, const std::string& what, const std::string& when,
                     const std::string& usual) {
  auto* database = verb.add_option("--db", o.database, "keep " + what + " in this SQLite file, for armcal history");
  verb.add_option("--date", o.date, "with --db: " + when)->needs(database)->check(CLI::Validator(WhyNoDate, "DATE"));
  auto* arm = verb.add_option("--arm", o.arm, "with --db: name of the arm" + usual);
  if (usual.empty()) database->needs(arm), arm->needs(database);
}

void AddDriveFleetOptions(CLI::App& verb, FleetOptions& o, const std::string& what) {
  AddFleetOptions(verb, o, what, "when this was (default: now)");
}

}  // namespace armcal::tool
