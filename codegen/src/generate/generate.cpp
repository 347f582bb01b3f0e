// generate - writes the files of a model and prints what they cost.
#include "codegen/src/generate/generate.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/generator/load.hpp"
#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/json.hpp"

namespace armcal::codegen {
namespace {

// What each standby effect costs on the target: rows of the filter's triangle, table, states, and what the regressor
// computes more than without it.
void PrintStandby(const Model& model, const Passport& with) {
  for (std::size_t k = 0; k < model.robot().effect.size(); ++k) {
    const EffectUse& use = model.robot().effect[k];
    if (use.state != "standby") continue;
    Robot robot = model.robot();
    robot.effect.erase(robot.effect.begin() + static_cast<std::ptrdiff_t>(k));
    robot.ceilings.parameter.clear();  // they may name what is left out, and cost nothing
    const Model without(robot, LoadCatalogue());
    const Passport less = Emit(without).passport;
    const int columns = model.columns() - without.columns();
    std::printf(
        "standby: %s: %d columns, %d bytes of filter state, %d bytes of table, %d bytes of states, %d operations, %d "
        "other functions\n",
        use.effect.c_str(), columns, 4 * columns * (model.dense() + 3),
        16 * (model.parameters() - without.parameters()), 8 * (model.states() - without.states()),
        with.multiplications + with.additions - less.multiplications - less.additions, with.functions - less.functions);
  }
}

}  // namespace

void AddGenerateOptions(CLI::App& verb, GenerateOptions& o) {
  verb.add_option("--robot", o.robot, "robot file, or a name in codegen/robots")->required();
  verb.add_option("--out", o.out, "folder to write (default: codegen/generated/<robot>)");
  verb.add_option("--json", o.json, "write the figures here");
}

void Generate(const GenerateOptions& o) {
  const Model model = LoadModel(o.robot);
  const GeneratedFiles files = Emit(model);
  const std::filesystem::path folder =
      o.out.empty() ? Home() / "codegen" / "generated" / model.robot().name : std::filesystem::path(o.out);
  WriteFiles(files, folder);
  const Passport& c = files.passport;
  std::printf(
      "%s: %d joints, %d filter coordinates (%d front, %d rigid base, %d shared), %d table parameters, schema %08X\n",
      model.robot().name.c_str(), model.joints(), model.columns(), model.front(), model.rigid(),
      model.dense() - model.rigid(), model.parameters(), files.schema);
  std::printf("regressor: %d multiplications, %d additions, %d divisions, %d sines and cosines, %d other functions\n",
              c.multiplications, c.additions, c.divisions, c.sincos, c.functions);
  if (model.states() > 0)
    std::printf("states: %d, for the extended Kalman filter %d sensitivities more\n", model.states(),
                model.sensitivities());
  PrintStandby(model, c);
  std::printf("written: %s\n", folder.c_str());
  if (o.json.empty()) return;
  const nlohmann::ordered_json json{{"robot", model.robot().name}, {"schema", files.schema},
                                    {"folder", folder.string()},   {"multiplications", c.multiplications},
                                    {"additions", c.additions},    {"sincos", c.sincos}};
  io::AtomicWrite(o.json, io::JsonText(json, 1) + "\n");
}

}  // namespace armcal::codegen
