// tool - armcal flash: brings a table file into the drive. armcal verify: tells whether this table is in force.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>

#include "armcal/core/crc.hpp"
#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/register_text.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/identify/calibration/table_ceilings.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/fleet.hpp"
#include "host_sim/tool/table_values.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

using nlohmann::ordered_json;

struct FlashOptions {
  std::string connect, robot, table, json, key;
  FleetOptions fleet;
  bool force = false, leave_out = false, dry_run = false, trial = false;
  int limit_s = link::reg::kUsualTrial_s;  // of a trial
};

// Read before the drive is called, so that a wrong file is named even where no drive answers.
struct ToFlash {
  explicit ToFlash(const FlashOptions& o) : model(LoadModel(o.robot)), file(calibration::ReadTable(o.table)) {
    calibration::TableFile layout = calibration::DefaultTable(model);
    carried = calibration::CarryOver(file, layout, o.table);
    other_version = file.schema != layout.schema;
    if (!carried.unknown.empty() && !o.leave_out)
      throw io::InputError(fmt::format(
          "{}: {}: not in the model of {}, and the other values were fitted together with it; build the drive "
          "from the robot file of this table, or give --leave-out",
          o.table, fmt::join(carried.unknown, ", "), model.robot().name));
  }
  codegen::Model model;
  calibration::TableFile file;
  calibration::CarriedOver carried;  // between the file and the model
  bool other_version;                // the file was made for another version of the model
};

// What the file means for this drive.
struct Sending {
  std::vector<std::uint16_t> words;
  calibration::TableFile active;  // in force now
  calibration::TableFile table;   // of the words
  std::vector<std::string> kept;  // friction and effects that rest on the prior: the drive's values stand unless forced
};

Sending SendingOf(client::DriveClient& drive, const FlashOptions& o, const ToFlash& read) {
  const codegen::Model& model = read.model;
  const calibration::TableFile& file = read.file;
  const calibration::TableFile layout = LayoutOf(drive, model),
                               active = calibration::DecodeTable(client::ReadActiveTable(drive), layout);
  Sending out{{}, active, active, {}};
  calibration::TableFile& sent = out.table;
  calibration::CarryOver(file, sent, o.table);
  std::copy(std::begin(file.forgetting), std::end(file.forgetting), sent.forgetting);
  sent.bumpless = file.bumpless;
  sent.blend_ms = file.blend_ms;
  for (std::size_t k = 0; k < sent.row.size(); ++k) {
    calibration::TableRow& row = sent.row[k];
    if (!row.from_prior || static_cast<int>(k) < model.body_parameters()) continue;  // bodies are one physical set
    row.mean = o.force ? row.free_mean : active.row[k].mean;
    if (!o.force) out.kept.push_back(row.name);
  }
  out.words = calibration::EncodeTable(sent);
  if (out.words[2] > 1 && drive.ReadIdentity().map_minor < client::kMinorOfLayout2)
    throw io::InputError(
        fmt::format("{}: gate_sigma: {} does not know it; expected a drive of map 1.{} or newer, or a "
                    "table without this key",
                    o.table, drive.name(), client::kMinorOfLayout2));
  return out;
}

void PrintVersion(const FlashOptions& o, const ToFlash& read) {
  if (!read.other_version) return;
  fmt::print(
      "{}: was made for another version of the model of {} (schema {:08X}, here {:08X}); its values are carried "
      "over by name\n",
      o.table, read.file.robot, read.file.schema, codegen::Schema(read.model));
  if (!read.carried.unknown.empty())
    fmt::print("not in this model, so left out: {}\n", fmt::join(read.carried.unknown, ", "));
}

// Parameters whose value is the drive's own, not the file's.
std::vector<std::string> DrivesOwn(const ToFlash& read, const Sending& sending) {
  std::vector<std::string> names = read.carried.missing;
  names.insert(names.end(), sending.kept.begin(), sending.kept.end());
  return names;
}

// What would be sent, without sending it.
int DryRun(const FlashOptions& o, client::DriveClient& drive, const Sending& sending, const client::Key* key,
           ordered_json json) {
  (void)client::NextCounter(drive, key);  // throws if the drive would not take a table with this key
  json["dry_run"] = true, json["changes"] = ordered_json::array();
  for (const ValueChange& c : ChangesOf(sending.active, calibration::DecodeTable(sending.words, sending.active))) {
    fmt::print("{}: {} -> {}\n", c.name, ValueText(c.from), ValueText(c.to));
    json["changes"].push_back({{"name", c.name}, {"from", c.from}, {"to", c.to}});
  }
  fmt::print("dry run: {} registers would be sent, nothing was; values that would change: {}\n", sending.words.size(),
             json["changes"].size());
  WriteJson(o.json, json);
  return kOk;
}

// The end of a trial puts the stored table in force again.
void RequireWayBack(client::DriveClient& drive) {
  const core::Status table = drive.ReadStatus().table_status;
  if (table != core::Status::kOk)
    throw client::RefusedError(
        fmt::format("{}: has no valid table to which a trial could go back ({}); flash the first "
                    "table without --trial",
                    drive.name(), client::StatusName(table)),
        0, table);
}

// said: what the JSON says if something fails after the flash.
int Flash(const FlashOptions& o, ordered_json& said) {
  const std::optional<client::Key> key = ReadKeyOption(o.key);
  const ToFlash read(o);
  if (!o.dry_run) TryFleet(o.fleet);
  client::DriveClient drive = ConnectTo(o.connect);
  const Sending sending = SendingOf(drive, o, read);
  if (const std::string beyond = calibration::BeyondCeiling(read.model, sending.table); !beyond.empty())
    throw io::InputError(fmt::format("{}: {}, by [ceilings] of {}", o.table, beyond, o.robot));
  if (o.trial) RequireWayBack(drive);
  PrintVersion(o, read);
  for (const std::string& name : read.carried.missing)
    fmt::print("not in {}, kept as in the drive: {}\n", o.table, name);
  int kept = 0;
  for (const auto& row : sending.table.row) kept += row.from_prior;
  if (kept)
    fmt::print("{} of {} parameters rest on the prior{}\n", kept, sending.table.row.size(),
               o.force ? " (forced)" : "; friction and effects among them keep the drive's value");
  const std::vector<std::string> own = DrivesOwn(read, sending);
  if (o.dry_run)
    return DryRun(o, drive, sending, KeyOf(key),
                  {{"registers", sending.words.size()}, {"from_prior", kept}, {"kept", own}});
  client::FlashReport report;
  {
    report::Progress progress("flash");
    const auto show = [&](double share) { progress.Set(share); };
    report = o.trial ? client::TryTable(drive, sending.words, o.limit_s, show, KeyOf(key))
                     : client::FlashTable(drive, sending.words, show, KeyOf(key));
  }
  if (o.trial)
    fmt::print("{}: {} registers on trial for {} s, not stored, and read back: CRC {:08X}, generation {}\n",
               drive.name(), sending.words.size(), o.limit_s, report.crc, report.generation);
  else
    fmt::print("{}: {} registers stored, adopted and read back: CRC {:08X}, generation {}, store sequence {}\n",
               drive.name(), sending.words.size(), report.crc, report.generation, report.store_sequence);
  said = {{"table_crc", client::CrcText(report.crc)},
          {"readback_ok", true},
          {"generation", report.generation},
          {"store_sequence", report.store_sequence},
          {"registers", sending.words.size()},
          {"trial_s", o.trial ? o.limit_s : 0},
          {"from_prior", kept},
          {"kept", own}};
  WriteJson(o.json, said);
  KeepTable(o.fleet, drive, o.trial ? "flash --trial" : "flash", said, o.table);
  return kOk;
}

int Verify(const FlashOptions& o) {
  const ToFlash read(o);
  client::DriveClient drive = ConnectTo(o.connect);
  const Sending sending = SendingOf(drive, o, read);
  PrintVersion(o, read);
  const calibration::TableFile& wanted = sending.table;
  const auto active = client::ReadActiveTable(drive);
  const calibration::TableFile is = calibration::DecodeTable(active, wanted);
  int differ = 0;
  for (std::size_t k = 0; k < is.row.size(); ++k)
    if (static_cast<float>(is.row[k].mean) != static_cast<float>(wanted.row[k].mean) ||
        is.row[k].state != wanted.row[k].state) {
      ++differ;
      fmt::print("{}: drive {:.9g} {}, file {:.9g} {}\n", is.row[k].name, is.row[k].mean, is.row[k].state,
                 wanted.row[k].mean, wanted.row[k].state);
    }
  const std::vector<std::string> own = DrivesOwn(read, sending);
  const bool same = calibration::EncodeTable(is) == sending.words, compared = own.size() < is.row.size();
  fmt::print("{}: {}\n", drive.name(),
             !same      ? fmt::format("differs in {} parameters{}", differ, differ ? "" : " (joint settings or flags)")
             : compared ? "the table in force is this file's"
                        : "no parameter was compared, so nothing is known");
  if (!read.carried.missing.empty())
    fmt::print("not in {}, so not compared: {}\n", o.table, fmt::join(read.carried.missing, ", "));
  if (!sending.kept.empty())
    fmt::print("rest on the prior, so not compared (--force compares them): {}\n", fmt::join(sending.kept, ", "));
  WriteJson(
      o.json,
      {{"same", same && !compared ? ordered_json() : ordered_json(same)}, {"differ", differ}, {"not_compared", own}});
  return same && compared ? kOk : kMismatch;
}

CLI::App* AddCommon(CLI::App& app, const char* name, const char* help, const std::shared_ptr<FlashOptions>& o) {
  auto* verb = app.add_subcommand(name, help);
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--robot", o->robot, "robot file or name: the model the drive was built for")->required();
  verb->add_option("--table", o->table, "table file (TOML) of armcal identify")->required();
  verb->add_option("--json", o->json, "write the result here");
  verb->add_flag(
      "--force", o->force,
      "take friction and effects that rest on the prior from the table, too; without it the drive's values count");
  verb->add_flag("--leave-out", o->leave_out, "leave out parameters of the table that this model does not have");
  return verb;
}

}  // namespace

void AddFlash(CLI::App& app, Action& action) {
  auto o = std::make_shared<FlashOptions>();
  auto* verb = AddCommon(app, "flash",
                         "store a parameter table in the drive, adopt it and read it back\nexample: armcal flash "
                         "--connect 127.0.0.1:1502 --robot er20_like --table build/table.toml",
                         o);
  verb->add_flag("--dry-run", o->dry_run, "check, and say which values would change; nothing is sent or kept");
  AddKeyOption(*verb, o->key);
  AddDriveFleetOptions(*verb, o->fleet, "the table");
  auto* trial = verb->add_flag("--trial", o->trial,
                               "put it on trial: it is in force, and not stored until armcal trial --confirm");
  verb->add_option("--limit", o->limit_s, "seconds after which a trial ends by itself")
      ->needs(trial)
      ->capture_default_str()
      ->check(Between(1, int{link::reg::kLongestTrial_s}));
  verb->callback([o, &action] { action = Telling(o, &Flash, {{"readback_ok", false}}); });
}

void AddVerify(CLI::App& app, Action& action) {
  auto o = std::make_shared<FlashOptions>();
  auto* verb = AddCommon(app, "verify",
                         "compare the table in force with a file\nexample: armcal verify --connect 127.0.0.1:1502 "
                         "--robot er20_like --table build/table.toml",
                         o);
  verb->callback([o, &action] {
    action = [o] { return Reported(o->json, [&] { return Verify(*o); }, {{"same", nullptr}}); };
  });
}

}  // namespace armcal::tool
