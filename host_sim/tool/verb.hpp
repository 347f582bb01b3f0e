// tool - what every verb shares: exit codes and JSON output. One file a verb implements the rest.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "codegen/src/generator/load.hpp"

namespace armcal::tool {

// 0 ok, 2 usage or bad input, 3 link, 4 refused by the drive, 5 verify mismatch, 6 partial.
enum ExitCode : int { kOk = 0, kBadInput = 2, kLink = 3, kRefused = 4, kMismatch = 5, kPartial = 6 };

// The verb's work; its return value is the exit code. Set by the parsed subcommand, run by main.
using Action = std::function<int()>;

void AddGenerate(CLI::App& app, Action& action);
void AddSimulate(CLI::App& app, Action& action);
void AddExcite(CLI::App& app, Action& action);
void AddRecord(CLI::App& app, Action& action);
void AddEstimate(CLI::App& app, Action& action);
void AddIdentify(CLI::App& app, Action& action);
void AddDiagnose(CLI::App& app, Action& action);
void AddFlash(CLI::App& app, Action& action);
void AddVerify(CLI::App& app, Action& action);
void AddHealth(CLI::App& app, Action& action);
void AddLearning(CLI::App& app, Action& action);
void AddDemo(CLI::App& app, Action& action);
void AddBench(CLI::App& app, Action& action);
void AddSurvey(CLI::App& app, Action& action);

using codegen::Home;
using codegen::LoadCatalogue;
using codegen::LoadModel;
using codegen::RobotPath;

// Writes j to `path` if it is not empty; whole or not at all.
void WriteJson(const std::string& path, const nlohmann::ordered_json& j);

}  // namespace armcal::tool
