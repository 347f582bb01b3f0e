// cli - armcal generate: robot file -> C++ model, its description and its default table.
#include <fmt/core.h>

#include "codegen/src/generator/emit.hpp"
#include "host_sim/cli/verb.hpp"
#include "host_sim/io/files.hpp"

namespace armcal::cli {
namespace {

struct Options {
  std::string robot, out, json;
};

int Run(const Options& o) {
  const codegen::Model model = LoadModel(o.robot);
  const codegen::GeneratedFiles files = codegen::Emit(model);
  const std::filesystem::path folder =
      o.out.empty() ? Home() / "codegen" / "generated" / model.robot().name : std::filesystem::path(o.out);
  std::filesystem::create_directories(folder);
  for (const auto& [name, text] : files.text) io::AtomicWrite((folder / name).string(), text);
  const auto& c = files.passport;
  fmt::print(
      "{}: {} joints, {} filter coordinates ({} front, {} rigid base, {} shared), {} table parameters, schema {:08X}\n",
      model.robot().name, model.joints(), model.columns(), model.front(), model.rigid(), model.dense() - model.rigid(),
      model.parameters(), files.schema);
  fmt::print("regressor: {} multiplications, {} additions, {} divisions, {} sines and cosines, {} other functions\n",
             c.multiplications, c.additions, c.divisions, c.sincos, c.functions);
  // What a standby column costs on the target: one row of the filter's triangle and one multiply-add a row.
  for (const auto& p : model.table())
    if (p.state == "standby")
      fmt::print("standby: {} ({} bytes of filter state, {} bytes of table)\n", p.name, 4 * (model.dense() + 3), 16);
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
  auto o = std::make_shared<Options>();
  verb->add_option("--robot", o->robot, "robot file, or a name in codegen/robots")->required();
  verb->add_option("--out", o->out, "folder to write (default: codegen/generated/<robot>)");
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, &action] { action = [o] { return Run(*o); }; });
}

}  // namespace armcal::cli
