// cli - armcal generate: robot file -> C++ model, its description and its default table.
#include <fmt/core.h>

#include "codegen/src/generator/emit.hpp"
#include "host_sim/cli/verb.hpp"

namespace armcal::cli {
namespace {

struct GenerateOptions {
  std::string robot, out, json;
};

// What each standby effect costs on the target: rows of the filter's triangle, table, states, and what the regressor
// computes more than without it.
void PrintStandby(const codegen::Model& model, const codegen::Passport& with) {
  for (std::size_t k = 0; k < model.robot().effect.size(); ++k) {
    const codegen::EffectUse& use = model.robot().effect[k];
    if (use.state != "standby") continue;
    codegen::Robot robot = model.robot();
    robot.effect.erase(robot.effect.begin() + static_cast<std::ptrdiff_t>(k));
    const codegen::Model without(robot, LoadCatalogue());
    const codegen::Passport less = codegen::Emit(without).passport;
    const int columns = model.columns() - without.columns();
    fmt::print(
        "standby: {}: {} columns, {} bytes of filter state, {} bytes of table, {} bytes of states, {} operations, {} "
        "other "
        "functions\n",
        use.effect, columns, 4 * columns * (model.dense() + 3), 16 * (model.parameters() - without.parameters()),
        8 * (model.states() - without.states()),
        with.multiplications + with.additions - less.multiplications - less.additions, with.functions - less.functions);
  }
}

int RunGenerate(const GenerateOptions& o) {
  const codegen::Model model = LoadModel(o.robot);
  const codegen::GeneratedFiles files = codegen::Emit(model);
  const std::filesystem::path folder =
      o.out.empty() ? Home() / "codegen" / "generated" / model.robot().name : std::filesystem::path(o.out);
  codegen::WriteFiles(files, folder);
  const auto& c = files.passport;
  fmt::print(
      "{}: {} joints, {} filter coordinates ({} front, {} rigid base, {} shared), {} table parameters, schema {:08X}\n",
      model.robot().name, model.joints(), model.columns(), model.front(), model.rigid(), model.dense() - model.rigid(),
      model.parameters(), files.schema);
  fmt::print("regressor: {} multiplications, {} additions, {} divisions, {} sines and cosines, {} other functions\n",
             c.multiplications, c.additions, c.divisions, c.sincos, c.functions);
  if (model.states() > 0)
    fmt::print("states: {}, for the extended Kalman filter {} sensitivities more\n", model.states(),
               model.sensitivities());
  PrintStandby(model, c);
  fmt::print("written: {}\n", folder.string());
  WriteJson(o.json, {{"robot", model.robot().name},
                     {"schema", files.schema},
                     {"folder", folder.string()},
                     {"multiplications", c.multiplications},
                     {"additions", c.additions},
                     {"sincos", c.sincos}});
  return kOk;
}

}  // namespace

void AddGenerate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "generate", "make the C++ model of a robot file\nexample: armcal generate --robot er20_like --out build/model");
  auto o = std::make_shared<GenerateOptions>();
  verb->add_option("--robot", o->robot, "robot file, or a name in codegen/robots")->required();
  verb->add_option("--out", o->out, "folder to write (default: codegen/generated/<robot>)");
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, &action] { action = [o] { return RunGenerate(*o); }; });
}

}  // namespace armcal::cli
