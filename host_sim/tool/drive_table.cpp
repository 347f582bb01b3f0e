// tool - the verbs about the table of a drive: backup, restore, diff, rollback, trial, log.
#include <fmt/core.h>

#include <algorithm>

#include "armcal/core/words.hpp"
#include "armcal/link/event_log.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/client/register_text.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/client/table_seal.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/fleet.hpp"
#include "host_sim/tool/table_values.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

namespace reg = link::reg;
using nlohmann::ordered_json;

struct TableOptions {
  std::string connect, json, file, key, robot;
  FleetOptions fleet;
  bool confirm = false, end = false, another_drive = false;
};

ordered_json Told(const client::FlashReport& report) {
  return {{"table_crc", client::CrcText(report.crc)},
          {"readback_ok", true},
          {"generation", report.generation},
          {"store_sequence", report.store_sequence}};
}

// The table in force as a file, and back ------------------------------------------------------------------------------

ordered_json Backup(client::DriveClient& drive) {
  const client::Identity id = drive.ReadIdentity();
  const auto words = client::ReadActiveTable(drive);
  const client::DriveStatus s = drive.ReadStatus();
  if (s.table_status != core::Status::kOk)
    throw client::RefusedError(
        fmt::format("{}: has no valid table: {}", drive.name(), client::StatusName(s.table_status)), 0, s.table_status);
  return client::BackupJson(words, id.schema, id.serial_number);
}

// The seal says who stored a table and when, and nothing about the arm.
client::TableBackup ReadUnsealed(const std::string& path) {
  client::TableBackup backup = client::ReadBackup(path);
  backup.words = client::UnsealTable(backup.words);
  return backup;
}

// Empty, or that a backup comes from another drive than this one.
std::string OfAnotherDrive(const TableOptions& o, client::DriveClient& drive, const client::TableBackup& backup) {
  const std::uint32_t here = drive.ReadIdentity().serial_number;
  if (!backup.serial_number || *backup.serial_number == here) return "";
  return fmt::format("{}: is of the drive with serial number {}, and {} has {}", o.file, *backup.serial_number,
                     drive.name(), here);
}

int RunBackup(const TableOptions& o, ordered_json&) {
  client::DriveClient drive = ConnectTo(o.connect);
  const ordered_json backup = Backup(drive);
  files::WriteWholeFile(o.file, io::JsonText(backup, 1) + "\n");
  fmt::print("{}: {} registers, CRC {}, written to {}\n", drive.name(), backup["words"].size(),
             backup["table_crc"].get<std::string>(), o.file);
  WriteJson(o.json, {{"file", o.file}, {"table_crc", backup["table_crc"]}, {"registers", backup["words"].size()}});
  return kOk;
}

int RunRestore(const TableOptions& o, ordered_json& said) {
  const client::TableBackup backup = ReadUnsealed(o.file);
  const std::vector<std::uint16_t>& words = backup.words;
  const std::optional<client::Key> key = ReadKeyOption(o.key);
  TryFleet(o.fleet);
  client::DriveClient drive = ConnectTo(o.connect);
  if (const std::string other = OfAnotherDrive(o, drive, backup); !other.empty() && !o.another_drive)
    throw io::InputError(other + "; --another-drive restores it all the same");
  const client::FlashReport report = client::FlashTable(drive, words, {}, KeyOf(key));
  fmt::print("{}: {} registers stored, adopted and read back: CRC {}, generation {}, store sequence {}\n", drive.name(),
             words.size(), client::CrcText(report.crc), report.generation, report.store_sequence);
  said = Told(report);
  WriteJson(o.json, said);
  KeepTable(o.fleet, drive, "restore", said, o.file);
  return kOk;
}

// The layout of drive and backup; nothing without a robot file.
std::optional<calibration::TableFile> LayoutOfBoth(const TableOptions& o, client::DriveClient& drive,
                                                   const std::vector<std::uint16_t>& words) {
  if (o.robot.empty()) return std::nullopt;
  const codegen::Model model = LoadModel(o.robot);
  calibration::TableFile layout = LayoutOf(drive, model);
  if (const std::uint32_t schema = words.size() < 2 ? 0 : core::GetU32(words.data()); schema != layout.schema)
    throw io::InputError(
        fmt::format("{}: has schema {:08X}, expected {:08X} of robot {}; without --robot its words are "
                    "compared",
                    o.file, schema, layout.schema, model.robot().name));
  return layout;
}

int RunDiff(const TableOptions& o, ordered_json&) {
  const client::TableBackup backup = ReadUnsealed(o.file);
  const std::vector<std::uint16_t>& words = backup.words;
  client::DriveClient drive = ConnectTo(o.connect);
  const std::optional<calibration::TableFile> layout = LayoutOfBoth(o, drive, words);
  const std::string other = OfAnotherDrive(o, drive, backup);
  if (!other.empty()) fmt::print("{}\n", other);
  const auto active = client::UnsealTable(client::ReadActiveTable(drive));
  ordered_json differ = ordered_json::array();
  for (std::size_t k = 0; k < std::max(words.size(), active.size()); ++k) {
    const auto is = k < active.size() ? ordered_json(active[k]) : ordered_json(),
               was = k < words.size() ? ordered_json(words[k]) : ordered_json();
    if (is == was) continue;
    differ.push_back({{"word", k}, {"drive", is}, {"file", was}});
    if (!layout) fmt::print("word {}: drive {}, file {}\n", k, io::JsonText(is), io::JsonText(was));
  }
  ordered_json said = {{"same", differ.empty()}, {"differ", differ}, {"another_drive", !other.empty()}};
  if (layout) {
    said["values"] = ordered_json::array();
    for (const ValueChange& c :
         ChangesOf(calibration::DecodeTable(active, *layout), calibration::DecodeTable(words, *layout))) {
      said["values"].push_back({{"name", c.name}, {"drive", c.from}, {"file", c.to}});
      fmt::print("{}: drive {}, file {}\n", c.name, ValueText(c.from), ValueText(c.to));
    }
  }
  fmt::print("{}: {}\n", drive.name(),
             differ.empty() ? "the table in force is this file's" : fmt::format("{} words differ", differ.size()));
  WriteJson(o.json, said);
  return differ.empty() ? kOk : kMismatch;
}

// rollback, trial, log ------------------------------------------------------------------------------------------------

int RunRollback(const TableOptions& o, ordered_json& said) {
  const std::optional<client::Key> key = ReadKeyOption(o.key);
  TryFleet(o.fleet);
  client::DriveClient drive = ConnectTo(o.connect);
  const client::FlashReport report = client::Rollback(drive, KeyOf(key));
  fmt::print("{}: the older table is stored, adopted and read back: CRC {}, generation {}, store sequence {}\n",
             drive.name(), client::CrcText(report.crc), report.generation, report.store_sequence);
  said = Told(report);
  WriteJson(o.json, said);
  KeepTable(o.fleet, drive, "rollback", said);
  return kOk;
}

int RunTrial(const TableOptions& o, ordered_json& said) {
  TryFleet(o.fleet);
  client::DriveClient drive = ConnectTo(o.connect);
  if (o.confirm) {
    const client::FlashReport report = client::ConfirmTrial(drive);
    fmt::print("{}: the table on trial is stored: CRC {}, store sequence {}\n", drive.name(),
               client::CrcText(report.crc), report.store_sequence);
    said = Told(report);
    WriteJson(o.json, said);
    KeepTable(o.fleet, drive, "trial --confirm", said);
    return kOk;
  }
  if (o.end) client::EndTrial(drive);
  const int left_s = drive.ReadIdentity().map_minor < client::kMinorOfLayout2 ? 0 : drive.ReadValue<reg::kTrialLeft>();
  const client::DriveStatus s = drive.ReadStatus();
  fmt::print("{}: {}\n", drive.name(),
             left_s > 0
                 ? fmt::format("a table is on trial for {} s more", left_s)
                 : fmt::format("no table is on trial; the table in force has CRC {}", client::CrcText(s.active_crc)));
  WriteJson(o.json, {{"on_trial", left_s > 0}, {"left_s", left_s}, {"table_crc", client::CrcText(s.active_crc)}});
  return kOk;
}

const char* CommandName(std::uint32_t command) {
  switch (command) {
    case reg::kOpen:
      return "open";
    case reg::kCheck:
      return "check";
    case reg::kSave:
      return "save";
    case reg::kTrial:
      return "trial";
    case reg::kConfirm:
      return "confirm";
    case reg::kBack:
      return "back";
    case reg::kLoad:
      return "load";
    case link::kBootEvent:
      return "boot";
    case link::kDropEvent:
      return "drop";
    default:
      return "unknown";
  }
}

// The drive may add an event between two requests, so the log is read until its count stays.
link::Words<reg::kLogBlock> ReadLog(client::DriveClient& drive) {
  for (;;) {
    const auto log = drive.Read<reg::kLogBlock>();
    if (log.Get<reg::kLogCount>() == drive.ReadValue<reg::kLogCount>()) return log;
  }
}

int RunLog(const TableOptions& o, ordered_json&) {
  client::DriveClient drive = ConnectTo(o.connect);
  if (const client::Identity id = drive.ReadIdentity(); id.map_minor < client::kMinorOfLayout2)
    throw client::RefusedError(fmt::format("{}: its map {}.{} has no log; expected a drive of map 1.{} or newer",
                                           drive.name(), id.map_major, id.map_minor, client::kMinorOfLayout2),
                               0, core::Status::kBadAddress);
  const auto log = ReadLog(drive);
  const std::uint32_t count = log.Get<reg::kLogCount>(),
                      first = count - std::min<std::uint32_t>(count, reg::kLogEvents);
  ordered_json events = ordered_json::array();
  if (first > 0) fmt::print("{} older events are no longer held\n", first);
  for (std::uint32_t k = first; k != count; ++k) {
    const std::uint32_t place = k % reg::kLogEvents, connection = log.At<reg::kLogConnection>(place);
    const auto status = static_cast<core::Status>(log.At<reg::kLogStatus>(place));
    const char* const command = CommandName(log.At<reg::kLogCommand>(place));
    fmt::print("tick {:>10}  {:>16}  {:<8}{}\n", log.At<reg::kLogTick>(place),
               connection == 0 ? std::string("drive") : fmt::format("connection {}", connection), command,
               client::StatusName(status));
    events.push_back({{"event", k},
                      {"tick", log.At<reg::kLogTick>(place)},
                      {"connection", connection},
                      {"command", command},
                      {"status", static_cast<int>(status)}});
  }
  WriteJson(o.json, {{"events", count}, {"log", events}});
  return kOk;
}

CLI::App* AddVerb(CLI::App& app, Action& action, const char* name, const char* help,
                  const std::shared_ptr<TableOptions>& o, int (*run)(const TableOptions&, ordered_json& said)) {
  auto* verb = app.add_subcommand(name, help);
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--json", o->json, "write the result here");
  verb->callback([o, &action, run] { action = Telling(o, run); });
  return verb;
}

}  // namespace

void AddDriveTable(CLI::App& app, Action& action) {
  auto o = std::make_shared<TableOptions>();
  auto* verb = AddVerb(app, action, "backup",
                       "write the table in force to a file, word for word\nexample: armcal backup drive.json --connect "
                       "127.0.0.1:1502",
                       o, RunBackup);
  verb->add_option("file", o->file, "file to write")->required();
  o = std::make_shared<TableOptions>();
  verb = AddVerb(app, action, "restore",
                 "store and adopt the table of a backup\nexample: armcal restore drive.json --connect 127.0.0.1:1502",
                 o, RunRestore);
  verb->add_option("file", o->file, "file of armcal backup")->required();
  verb->add_flag("--another-drive", o->another_drive, "also a backup of another drive");
  AddKeyOption(*verb, o->key);
  AddDriveFleetOptions(*verb, o->fleet, "the table");
  o = std::make_shared<TableOptions>();
  verb = AddVerb(app, action, "diff",
                 "compare the table in force with a backup\nexit code 5: they differ\nexample: armcal diff drive.json "
                 "--robot er20_like --connect 127.0.0.1:1502",
                 o, RunDiff);
  verb->add_option("file", o->file, "file of armcal backup")->required();
  verb->add_option("--robot", o->robot, "robot file or name: name the values that differ (default: numbers of words)");
  o = std::make_shared<TableOptions>();
  verb =
      AddVerb(app, action, "rollback",
              "store and adopt the table that was stored before the one in force\nexample: armcal rollback --connect "
              "127.0.0.1:1502",
              o, RunRollback);
  AddKeyOption(*verb, o->key);
  AddDriveFleetOptions(*verb, o->fleet, "the table");
  o = std::make_shared<TableOptions>();
  verb = AddVerb(app, action, "trial",
                 "show, store or end the trial that armcal flash --trial began\nexample: armcal trial --confirm "
                 "--connect 127.0.0.1:1502",
                 o, RunTrial);
  auto* confirm = verb->add_flag("--confirm", o->confirm, "store the table on trial");
  verb->add_flag("--end", o->end, "put the stored table in force again")->excludes(confirm);
  AddDriveFleetOptions(*verb, o->fleet, "the table that --confirm stores");
  AddVerb(app, action, "log",
          "show what became of the drive's tables since power-up: the last 32 events\nexample: armcal log --connect "
          "127.0.0.1:1502",
          std::make_shared<TableOptions>(), RunLog);
}

}  // namespace armcal::tool
