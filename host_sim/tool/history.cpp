// tool - armcal history: what a database says of one arm over time.
#include "host_sim/diagnose/fleet/history.hpp"

#include <fmt/format.h>

#include "codegen/src/io/faults.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct HistoryOptions {
  std::string arm, database, json, report;
};

int RunHistory(const HistoryOptions& o) {
  const auto of = [&](fleet::Kind kind) { return fleet::EntriesOf(o.database, kind, o.arm); };
  const std::vector<fleet::Entry> verdicts = of(fleet::Kind::kVerdict), tables = of(fleet::Kind::kTable),
                                  readings = of(fleet::Kind::kHealth);
  if (verdicts.empty() && tables.empty() && readings.empty()) {
    const std::vector<std::string> arms = fleet::ArmsOf(o.database);
    const std::string nearest = io::Nearest(o.arm, arms);
    throw io::InputError(
        fmt::format("{}: nothing of the arm {}; {}", o.database, o.arm,
                    nearest.empty() ? fmt::format("it has {}", fmt::join(arms, ", ")) : "the nearest is " + nearest));
  }
  const fleet::History history = fleet::HistoryOf(verdicts, tables, readings);
  fmt::print("{}", fleet::HistoryText(history));
  WriteJson(o.json, fleet::HistoryJson(history));
  if (!o.report.empty()) {
    fleet::WriteHistoryPage(o.report, o.arm, history);
    fmt::print("report: {}\n", o.report);
  }
  return kOk;
}

}  // namespace

void AddHistory(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "history",
      "show an arm's friction, payload and errors over its logs, what changed when, and what became of its drive\n"
      "example: armcal history line3_robot1 --db fleet.sqlite --report history.html");
  auto o = std::make_shared<HistoryOptions>();
  verb->add_option("arm", o->arm, "name of the arm: of the log in a batch, or that of --arm")->required();
  verb->add_option("--db", o->database, "database that --db of another verb wrote")->required();
  verb->add_option("--json", o->json, "write logs, courses and changes here");
  verb->add_option("--report", o->report, "page with a picture of each quantity");
  verb->callback([o, &action] { action = [o] { return RunHistory(*o); }; });
}

}  // namespace armcal::tool
