// tool - reads the command line, runs one verb, and turns every failure into one line and an exit code.
#include <fmt/core.h>
#include <malloc.h>

#include <cstdio>
#include <exception>

#include "host_sim/client/errors.hpp"
#include "host_sim/data/report/colour.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

// Matrices of some MB are made and freed all the time. Each would be taken from the system and given back, which cost
// choose more time than its arithmetic.
void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
}

int Main(int argc, char** argv) {
  KeepFreedMemory();
  const std::vector<std::string> words = WordsOf(argc, argv);
  CLI::App app{
      "armcal: estimate the dynamic parameters of an arm, find what its model lacks, flash the table that mends it",
      "armcal"};
  app.require_subcommand(1);
  app.set_version_flag("--version", Version());
  Action action;
  AddSimulate(app, action);
  AddExcite(app, action);
  AddRecord(app, action);
  AddEstimate(app, action);
  AddIdentify(app, action);
  AddEvaluate(app, action);
  AddReplay(app, action);
  AddChoose(app, action);
  AddDiagnose(app, action);
  AddHistory(app, action);
  AddReport(app, action);
  AddImport(app, action);
  AddChannels(app, action);
  AddConvert(app, action);
  AddGenerate(app, action);
  AddExport(app, action);
  AddFlash(app, action);
  AddVerify(app, action);
  AddHealth(app, action);
  AddLearning(app, action);
  AddDevice(app, action);
  AddDriveTable(app, action);
  AddDemo(app, action);
  AddBench(app, action);
  AddSurvey(app, action);
  AddPages(app, action);
  for (CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    if (!verb->get_name().empty()) verb->set_version_flag("--version", Version());
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 takes them from the back
    CheckOutputs(app);
    return action();
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e), kOk;  // --help, --version
    std::fprintf(stderr, "%s\n", WrongUse(app, words, e).c_str());
    return kBadInput;
  } catch (const std::exception& e) {
    const std::string who = report::Coloured("armcal:", report::Ink::kRed, stderr);
    std::fprintf(stderr, "%s %s\n", who.c_str(), e.what());
    return ExitCodeOf(e);
  }
}

}  // namespace

int ExitCodeOf(const std::exception& error) {
  if (dynamic_cast<const client::InterruptedError*>(&error) != nullptr) return kInterrupted;
  if (dynamic_cast<const client::LinkError*>(&error) != nullptr) return kLink;
  if (dynamic_cast<const client::RefusedError*>(&error) != nullptr) return kRefused;
  if (dynamic_cast<const client::VerifyError*>(&error) != nullptr) return kMismatch;
  return kBadInput;
}

bool WasSent(const std::exception& error) { return dynamic_cast<const client::SentError*>(&error) != nullptr; }

}  // namespace armcal::tool

int main(int argc, char** argv) { return armcal::tool::Main(argc, argv); }
