// tool - holds what every verb shares: exit codes, JSON output, and the search for files that a user names.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::tool {

enum ExitCode : int {
  kOk = 0,
  kBadInput = 2,       // wrong use, too
  kLink = 3,           // no link to the drive
  kRefused = 4,        // by the drive
  kMismatch = 5,       // what was read back is not what was written
  kPartial = 6,        // the result is incomplete
  kInterrupted = 130,  // ended by Ctrl-C
};

// The verb's work; its return value is the exit code. Set by the parsed subcommand, run by main.
using Action = std::function<int()>;

void AddImport(CLI::App& app, Action& action);
void AddChannels(CLI::App& app, Action& action);
void AddConvert(CLI::App& app, Action& action);
void AddGenerate(CLI::App& app, Action& action);
void AddSimulate(CLI::App& app, Action& action);
void AddExcite(CLI::App& app, Action& action);
void AddRecord(CLI::App& app, Action& action);
void AddEstimate(CLI::App& app, Action& action);
void AddIdentify(CLI::App& app, Action& action);
void AddEvaluate(CLI::App& app, Action& action);
void AddReplay(CLI::App& app, Action& action);
void AddChoose(CLI::App& app, Action& action);
void AddDiagnose(CLI::App& app, Action& action);
void AddHistory(CLI::App& app, Action& action);
void AddReport(CLI::App& app, Action& action);
void AddExport(CLI::App& app, Action& action);
void AddFlash(CLI::App& app, Action& action);
void AddVerify(CLI::App& app, Action& action);
void AddHealth(CLI::App& app, Action& action);
void AddLearning(CLI::App& app, Action& action);
void AddDemo(CLI::App& app, Action& action);
void AddDevice(CLI::App& app, Action& action);      // info, get, set, watch, scan, map
void AddDriveTable(CLI::App& app, Action& action);  // backup, restore, diff, rollback, trial, log
void AddBench(CLI::App& app, Action& action);
void AddSurvey(CLI::App& app, Action& action);

// Where armcal simulate listens.
inline constexpr int kSimulatedPort = 1502;

using codegen::Home;
using codegen::LoadCatalogue;
using codegen::LoadModel;
using codegen::RobotPath;

// Writes j to `path` if it is not empty; whole or not at all.
inline void WriteJson(const std::string& path, const nlohmann::ordered_json& j) {
  if (!path.empty()) files::WriteWholeFile(path, io::JsonText(j, 1) + "\n");
}

// The exit code that main() makes of an exception.
int ExitCodeOf(const std::exception& error);
// A table was sent, and it is unknown what the drive made of it.
bool WasSent(const std::exception& error);

// The result of an earlier run goes before the work begins, so that none is left by a run that is killed.
inline void RemoveEarlier(const std::filesystem::path& path) {
  if (std::filesystem::is_regular_file(std::filesystem::symlink_status(path))) std::filesystem::remove(path);
}

// Runs a verb's work. If it fails, the JSON says so, with whatever `said` holds by then: what went wrong, and the exit
// code. The JSON of an earlier run goes first.
template <class Work>
int Reported(const std::string& path, Work work,
             const nlohmann::ordered_json& said = nlohmann::ordered_json::object()) {
  RemoveEarlier(path);
  try {
    return work();
  } catch (const std::exception& error) {
    nlohmann::ordered_json json = said;
    json["error"] = error.what();
    json["exit_code"] = ExitCodeOf(error);
    if (WasSent(error)) json["sent"] = true;
    WriteJson(path, json);
    throw;
  }
}

// A verb whose work says in `said` what the JSON is to hold if it fails later on. first: what `said` holds at the
// start.
template <class Options>
Action Telling(std::shared_ptr<Options> o, int (*run)(const Options&, nlohmann::ordered_json& said),
               nlohmann::ordered_json first = nlohmann::ordered_json::object()) {
  return [o, run, first] {
    nlohmann::ordered_json said = first;
    return Reported(
        o->json, [&] { return run(*o, said); }, said);
  };
}

// A scenario file by its path, or by its name in host_sim/scenarios. Throws io::InputError if there is none.
inline std::filesystem::path ScenarioPath(const std::string& scenario) {
  return codegen::NamedFile("scenario", scenario, Home() / "host_sim" / "scenarios");
}

}  // namespace armcal::tool
