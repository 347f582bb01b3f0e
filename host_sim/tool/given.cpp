// tool - reads a model whose parameters are given.
#include "host_sim/tool/given.hpp"

#include <fmt/core.h>

#include "codegen/src/io/input_error.hpp"

namespace armcal::tool {

void AddGivenOptions(CLI::App& verb, GivenOptions& o) {
  verb.add_option("--robot", o.robot, "robot file or name; without --table its own values are taken as they are");
  verb.add_option("--table", o.table,
                  "parameters: a table that identify --table-out wrote, or the JSON that identify --json wrote");
  verb.add_option("--model", o.model, "in the place of --robot: a robot file that diagnose --model-out wrote");
  verb.add_option("--payload", o.payload, "file with a [payload] table: the last link carries it, too");
}

codegen::Model GivenModel(const GivenOptions& o) {
  if (o.robot.empty() && o.model.empty()) throw io::InputError("--robot, --model: expected one of them");
  if (o.model.empty()) return LoadModel(o.robot);
  codegen::Model model = LoadModel(o.model);
  if (!o.robot.empty()) {
    const std::string robot = codegen::ReadRobot(RobotPath(o.robot)).name;
    if (robot != model.robot().name)
      throw io::InputError(
          fmt::format("{}: a model of robot {}, expected one of {} (--robot)", o.model, model.robot().name, robot));
  }
  return model;
}

calibration::Given ReadGiven(const GivenOptions& o, const codegen::Model& model) {
  calibration::Given given =
      o.table.empty() ? calibration::GivenByRobot(model) : calibration::GivenByFile(model, o.table);
  if (!given.missing.empty()) {
    std::string names;
    for (const std::string& name : given.missing) names += (names.empty() ? "" : ", ") + name;
    fmt::print(stderr, "{}: no value for {}: the robot file's are taken\n", o.table, names);
  }
  if (!o.payload.empty())
    calibration::AddPayload(model, codegen::ReadPayload(std::filesystem::path(o.payload)), o.payload, given);
  return given;
}

nlohmann::ordered_json ToJson(const GivenOptions& o, const codegen::Model& model) {
  nlohmann::ordered_json json{{"robot", model.robot().name}};
  for (const auto& [key, value] :
       {std::pair{"table", o.table}, std::pair{"model", o.model}, std::pair{"payload", o.payload}})
    if (!value.empty()) json[key] = value;
  return json;
}

}  // namespace armcal::tool
