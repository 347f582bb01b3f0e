// tool - armcal export: writes an identified arm for other programs, and says what their format cannot hold.
#include <fmt/format.h>

#include "host_sim/data/files/files.hpp"
#include "host_sim/identify/description/described_arm.hpp"
#include "host_sim/tool/given.hpp"

namespace armcal::tool {
namespace {

struct ExportOptions {
  GivenOptions given;
  std::string format, into, out, json;
  bool merge = false;
};

description::Description Write(const ExportOptions& o, const description::DescribedArm& arm) {
  const bool into = !o.into.empty();
  if (into && o.format != "urdf" && o.format != "sdf" && o.format != "mjcf")
    throw io::InputError("--into: expected --format urdf, sdf or mjcf beside it, not " + o.format);
  if (o.merge && o.format != "urdf" && !(into && o.format == "mjcf"))
    throw io::InputError("--merge: expected --format urdf, or --format mjcf with --into, beside it");
  if (o.format == "urdf") return description::ToGivenUrdf(arm, o.into, o.merge);
  if (into && o.format == "sdf") return description::ToGivenSdf(arm, o.into, files::ReadWholeFile(o.into));
  if (into && o.format == "mjcf") return description::ToGivenMjcf(arm, o.into, files::ReadWholeFile(o.into), o.merge);
  if (o.format == "sdf") return description::ToSdf(arm);
  if (o.format == "mjcf") return description::ToMjcf(arm);
  if (o.format == "yaml") return description::ToYaml(arm);
  if (o.format == "c") return description::ToHeader(arm);
  throw io::InputError("--format " + o.format + ": expected urdf, sdf, mjcf, yaml or c");
}

int Run(const ExportOptions& o) {
  const codegen::Model model = GivenModel(o.given);
  const std::string robot = o.given.model.empty() ? o.given.robot : o.given.model;
  const std::string source = o.given.table.empty() ? robot : o.given.table;
  const calibration::Given given = ReadGiven(o.given, model);
  const description::DescribedArm arm = description::Describe(model, given, source);
  const description::Description d = Write(o, arm);
  const std::filesystem::path read = o.into.empty() ? model.robot().urdf.path : std::filesystem::path(o.into);
  if (std::error_code none; std::filesystem::equivalent(o.out, read, none))
    throw io::InputError("--out " + o.out + ": is the file that is read; expected another file");
  files::WriteWholeFile(o.out, d.text);
  if (o.given.table.empty())
    fmt::print("values: those that {} states; --table takes what armcal identify found\n", robot);
  fmt::print("written: {} ({}, {} joints, schema {:08X})\n", o.out, o.format, arm.joint.size(), arm.schema);
  if (!given.from_prior.empty())
    fmt::print("the logs said little of {} parameters, which stay near the robot file's values: {}\n",
               given.from_prior.size(), fmt::join(given.from_prior, ", "));
  if (!d.left_out.empty()) fmt::print("not in the file, because {} has no place for it:\n", o.format);
  for (const std::string& line : d.left_out) fmt::print("  {}\n", line);
  nlohmann::ordered_json json = ToJson(o.given, model);
  json["format"] = o.format, json["file"] = o.out, json["schema"] = arm.schema, json["left_out"] = d.left_out;
  json["from_prior"] = given.from_prior;
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddExport(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "export",
      "write bodies and friction for other programs\nexample: armcal export --robot my_arm.toml --table new.toml "
      "--format urdf -o my_arm_identified.urdf");
  auto o = std::make_shared<ExportOptions>();
  AddGivenOptions(*verb, o->given);
  verb->add_option("--format", o->format, "urdf, sdf, mjcf, yaml or c")->required();
  verb->add_option("--into", o->into,
                   "a URDF, SDF or MJCF of this arm to write into (urdf: default the one that the robot file names)");
  verb->add_flag("--merge", o->merge, "urdf, mjcf: a moving link gets the whole body, the links fixed to it get none");
  verb->add_option("-o,--out", o->out, "file to write")->required();
  verb->add_option("--json", o->json, "write what was written, and what was left out, here");
  verb->callback([o, &action] { action = [o] { return Run(*o); }; });
}

}  // namespace armcal::tool
