// tool - armcal generate: does the work of the program armcal-generate.
#include "codegen/src/generate/generate.hpp"

#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

void AddGenerate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("generate", codegen::kGenerateHelp);
  auto o = std::make_shared<codegen::GenerateOptions>();
  codegen::AddGenerateOptions(*verb, *o);
  verb->get_option("--out")->type_name(kFolder);
  verb->callback([o, &action] {
    action = [o] {
      codegen::Generate(*o);
      return kOk;
    };
  });
}

}  // namespace armcal::tool
