// tool - reads the command line, runs one verb, and turns every failure into one line and an exit code.
#include <cstdio>
#include <exception>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/errors.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

int Fail(const std::exception& e, int code) {
  std::fprintf(stderr, "armcal: %s\n", e.what());
  return code;
}

int Main(int argc, char** argv) {
  CLI::App app{
      "armcal: estimate the dynamic parameters of an arm, find what its model lacks, flash the table that mends it"};
  app.require_subcommand(1);
  Action action;
  AddSimulate(app, action);
  AddExcite(app, action);
  AddRecord(app, action);
  AddEstimate(app, action);
  AddIdentify(app, action);
  AddEvaluate(app, action);
  AddReplay(app, action);
  AddDiagnose(app, action);
  AddImport(app, action);
  AddGenerate(app, action);
  AddExport(app, action);
  AddFlash(app, action);
  AddVerify(app, action);
  AddHealth(app, action);
  AddLearning(app, action);
  AddDemo(app, action);
  AddBench(app, action);
  AddSurvey(app, action);
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kBadInput;
  } catch (const io::InputError& e) {
    return Fail(e, kBadInput);
  } catch (const client::LinkError& e) {
    return Fail(e, kLink);
  } catch (const client::RefusedError& e) {
    return Fail(e, kRefused);
  } catch (const client::VerifyError& e) {
    return Fail(e, kMismatch);
  } catch (const std::exception& e) {
    return Fail(e, kBadInput);
  }
}

}  // namespace
}  // namespace armcal::tool

int main(int argc, char** argv) { return armcal::tool::Main(argc, argv); }
