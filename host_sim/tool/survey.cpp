// tool - armcal survey: starts the program that makes the survey's tables.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/survey_verb.hpp"

namespace armcal::tool {
namespace {

namespace fs = std::filesystem;

int StartSurvey(const CLI::App& verb) {
  const fs::path program = fs::path(OwnProgram()).parent_path() / "armcal-survey";
  if (!fs::is_regular_file(program)) throw io::InputError(program.string() + ": not there; build all of armcal");
  std::vector<std::string> words{program.string(), verb.get_name()};
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& value : option->results()) words.insert(words.end(), {option->get_name(), value});
  Become(words);
}

}  // namespace

void AddSurvey(CLI::App& app, Action& action) {
  AddSurveyVerb(app, action, [](const SurveyOptions&, const CLI::App& verb) { return StartSurvey(verb); });
}

}  // namespace armcal::tool
