// tool - armcal history: what a database of verdicts says of one arm over time.
#include "host_sim/diagnose/fleet/history.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdio>
#include <ctime>

#include "codegen/src/io/faults.hpp"
#include "host_sim/tool/fleet.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct HistoryOptions {
  std::string arm, database, json, report;
};

int RunHistory(const HistoryOptions& o) {
  const std::vector<fleet::Entry> entries = fleet::EntriesOf(o.database, o.arm);
  if (entries.empty()) {
    const std::vector<std::string> arms = fleet::ArmsOf(o.database);
    const std::string nearest = io::Nearest(o.arm, arms);
    throw io::InputError(
        fmt::format("{}: no verdict of the arm {}; {}", o.database, o.arm,
                    nearest.empty() ? fmt::format("it has {}", fmt::join(arms, ", ")) : "the nearest is " + nearest));
  }
  const fleet::History history = fleet::HistoryOf(entries);
  fmt::print("{}", fleet::HistoryText(history));
  WriteJson(o.json, fleet::HistoryJson(history));
  if (!o.report.empty() && !history.entry.empty()) {
    fleet::WriteHistoryPage(o.report, o.arm, history);
    fmt::print("report: {}\n", o.report);
  }
  return kOk;
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

}  // namespace

void KeepVerdicts(const FleetOptions& o, const verdict::Verdicts& verdicts,
                  const std::map<std::string, std::string>& log) {
  if (o.database.empty()) return;
  std::vector<fleet::Entry> entries;
  for (const auto& [arm, verdict] : verdicts) {
    fleet::Entry e{arm, o.date, arm, verdict.dump()};
    const auto named = log.find(arm);
    const std::string path = named != log.end() ? named->second : verdict.value("test", std::string());
    if (std::filesystem::is_regular_file(path)) {
      e.log = files::FileHash(path);
      if (e.date.empty()) e.date = Utc(ChangeTime(path));
    }
    if (e.date.empty()) e.date = Utc(std::time(nullptr));
    entries.push_back(e);
  }
  fleet::Keep(o.database, entries);
  fmt::print("kept in {}: {} verdicts\n", o.database, entries.size());
  std::fflush(stdout);  // who kills this process may rely on the line
}

void AddFleetOptions(CLI::App& verb, FleetOptions& o) {
  auto* database = verb.add_option("--db", o.database, "keep verdicts in this SQLite file, for armcal history");
  verb.add_option("--date", o.date, "with --db: when the held-out log was made (default: the file's time)")
      ->needs(database);
}

void AddHistory(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("history",
                                  "show an arm's friction, payload and errors over its logs, and what changed when\n"
                                  "example: armcal history line3_robot1 --db fleet.sqlite --report history.html");
  auto o = std::make_shared<HistoryOptions>();
  verb->add_option("arm", o->arm, "name of the arm: of the log in a batch, or --arm of armcal diagnose")->required();
  verb->add_option("--db", o->database, "database that armcal diagnose --db wrote")->required();
  verb->add_option("--json", o->json, "write logs, courses and changes here");
  verb->add_option("--report", o->report, "page with a picture of each quantity");
  verb->callback([o, &action] { action = [o] { return RunHistory(*o); }; });
}

}  // namespace armcal::tool
