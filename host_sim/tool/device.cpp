// tool - the verbs for a technician at a drive: info, get, set, watch, scan, map.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <thread>

#include "armcal/core/words.hpp"
#include "armcal/link/seal.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/client/register_text.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/client/writer_seat.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

namespace reg = link::reg;
using link::Register;
using link::RegisterKind;
using link::RegisterType;
using nlohmann::ordered_json;

struct DeviceOptions {
  std::string connect, json, name, value;
  int from = 0, to = 0, count = 0;  // from, to: 0: left out
  bool csv = false, markdown = false;
};

constexpr int kModbusPort = 502;
constexpr char kNameHelp[] = "name, as armcal map lists it; an element in brackets, from 0";
constexpr char kWhoMayWrite[] = "Without a key anyone who reaches the line may write within the ceilings.";
constexpr char kNobodyMayWrite[] = "The board refuses all writing now.";
constexpr char kSignedOnly[] = "Only tables that are signed with the drive's key are taken.";

// info ---------------------------------------------------------------------------------------------------------------

int RunInfo(const DeviceOptions& o, ordered_json&) {
  client::DriveClient drive = ConnectTo(o.connect);
  const client::Identity id = drive.ReadIdentity();
  const client::DriveStatus s = drive.ReadStatus();
  static const char* const states[] = {"idle",       "open",   "loading", "checked",
                                       "committing", "active", "failed",  "on trial"};
  static const char* const slots[] = {"blank", "good", "other schema", "corrupt", "refused at boot"};
  static const char* const feed[] = {"off", "on", "cross-fading"};
  const auto word = [](const auto& list, std::size_t k) { return k < std::size(list) ? list[k] : "?"; };
  const auto state = static_cast<std::size_t>(s.transaction_state);
  fmt::print("{}: serial number {}, firmware {}, map {}.{}, schema {}\n", drive.name(), id.serial_number,
             id.firmware_version, id.map_major, id.map_minor, client::CrcText(id.schema));
  fmt::print("model: {} axes, {} parameters, {} columns; {} ticks a second, {} a sample\n", id.axes, id.parameters,
             id.columns, id.tick_rate_Hz, id.sample_ticks);
  fmt::print("table: {}; CRC {}, generation {}, stored as {}; slots {} and {}; feed-forward {}\n",
             client::StatusName(s.table_status), client::CrcText(s.active_crc), s.generation, s.store_sequence,
             word(slots, s.slot_state[0]), word(slots, s.slot_state[1]), word(feed, s.feedforward_state));
  fmt::print(
      "now: tick {}, transaction {}, axes enabled 0x{:X}, health {}, {} samples refused because the estimator was "
      "behind\n",
      s.tick, word(states, state), s.enabled_axes, s.health, s.sample_gaps);
  ordered_json json{{"address", drive.name()},
                    {"serial_number", id.serial_number},
                    {"firmware_version", id.firmware_version},
                    {"map", fmt::format("{}.{}", id.map_major, id.map_minor)},
                    {"schema", client::CrcText(id.schema)},
                    {"axes", id.axes},
                    {"parameters", id.parameters},
                    {"columns", id.columns},
                    {"capabilities", id.capabilities},
                    {"tick_rate_Hz", id.tick_rate_Hz},
                    {"sample_ticks", id.sample_ticks},
                    {"table_status", static_cast<int>(s.table_status)},
                    {"table_crc", client::CrcText(s.active_crc)},
                    {"generation", s.generation},
                    {"store_sequence", s.store_sequence},
                    {"slots", {word(slots, s.slot_state[0]), word(slots, s.slot_state[1])}},
                    {"feedforward", word(feed, s.feedforward_state)},
                    {"transaction", word(states, state)},
                    {"tick", s.tick},
                    {"enabled_axes", s.enabled_axes},
                    {"health", s.health},
                    {"sample_gaps", s.sample_gaps}};
  if (id.map_minor >= 6) {
    const std::string version = VersionText(drive.ReadValue<link::reg::kLibraryVersion>());
    json["library"] = version;
    fmt::print("library: {}\n", version);
  }
  if (id.map_minor >= 3) {
    const auto w = drive.Read<reg::kWritingBlock>();
    static const char* const seats[] = {"free", "this connection", "another connection"};
    json["writer"] = word(seats, w.Get<reg::kWriterSeat>());
    json["save_wait_s"] = w.Get<reg::kSaveWait>();
    fmt::print("writer: {}; next save in {} s\n", word(seats, w.Get<reg::kWriterSeat>()), w.Get<reg::kSaveWait>());
  }
  const char* who_may_write = kWhoMayWrite;
  if (id.map_minor >= client::kMinorOfLayout2) {
    const auto w = drive.Read<reg::kTableBlock>();
    json["writing_allowed"] = w.Get<reg::kWritingAllowed>() != 0;
    json["trial_left_s"] = w.Get<reg::kTrialLeft>();
    const auto method = static_cast<link::SealMethod>(w.Get<reg::kSigning>());
    json["signing"] = method == link::SealMethod::kNone ? "none" : method == link::SealMethod::kHmac ? "hmac" : "own";
    json["signing_counter"] = w.Get<reg::kSigningCounter>();
    if (method != link::SealMethod::kNone) who_may_write = kSignedOnly;
    if (w.Get<reg::kWritingAllowed>() == 0) who_may_write = kNobodyMayWrite;
    if (w.Get<reg::kTrialLeft>() != 0) fmt::print("a table is on trial for {} s more\n", w.Get<reg::kTrialLeft>());
  }
  fmt::print("{}\n", who_may_write);
  json["who_may_write"] = who_may_write;
  WriteJson(o.json, json);
  return kOk;
}

// get, set -----------------------------------------------------------------------------------------------------------

// "generation", or "estimate_a[3]": elements count from 0.
struct Named {
  const Register* r;
  int element;  // -1: all
};

Named Find(const std::string& name) {
  const auto bracket = name.find('[');
  const std::string plain = name.substr(0, bracket);
  int element = -1;
  if (bracket != std::string::npos) {
    const char* const first = name.c_str() + bracket + 1;
    const auto [end, error] = std::from_chars(first, name.c_str() + name.size(), element);
    if (error != std::errc() || std::string(end) != "]" || element < 0)
      throw io::InputError(name + ": expected an element as in estimate_a[3], from 0");
  }
  for (const Register& r : link::kRegisters)
    if (plain == r.name) {
      if (element >= r.count) throw io::InputError(fmt::format("{}: has elements 0 to {}", name, r.count - 1));
      return {&r, element};
    }
  throw io::InputError(name + ": no such register; armcal map lists them");
}

ordered_json ValueOf(const Register& r, const std::uint16_t* w) {
  if (r.type == RegisterType::kU16) return *w;
  if (r.type == RegisterType::kU32) return core::GetU32(w);
  const float value = core::GetF32(w);
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

// How many elements the drive has of a register.
int Elements(client::DriveClient& drive, const Register& r) {
  const client::Identity id = drive.ReadIdentity();
  const std::string name = r.name;
  if (name == "residual_rms" || name == "consistency") return id.axes;
  if (name.rfind("estimate_", 0) == 0 || name.rfind("deviation_", 0) == 0) return id.columns;
  const bool active = name == "active_table";
  if (!active && name != "staged_table") return r.count;
  if (id.map_minor < client::kMinorOfLayout2) return id.table_words;
  return active ? drive.ReadValue<reg::kActiveWords>() : drive.ReadValue<reg::kTableRoom>();
}

ordered_json ReadRegister(client::DriveClient& drive, const Named& named) {
  const Register& r = *named.r;
  const int size = link::WordsOf(r.type);
  const int elements = Elements(drive, r);
  const int first = named.element < 0 ? 0 : named.element;
  const int count = named.element < 0 ? elements : 1;
  const auto words = r.kind == RegisterKind::kInput ? drive.ReadInput(r + first * size, count * size)
                                                    : drive.ReadHolding(r + first * size, count * size);
  ordered_json values = ordered_json::array();
  for (int k = 0; k < count; ++k) values.push_back(ValueOf(r, words.data() + k * size));
  return count == 1 ? values[0] : values;
}

int RunGet(const DeviceOptions& o, ordered_json&) {
  const Named named = Find(o.name);
  client::DriveClient drive = ConnectTo(o.connect);
  const ordered_json value = ReadRegister(drive, named);
  fmt::print("{} = {}{}{}\n", o.name, io::JsonText(value), *named.r->unit ? " " : "", named.r->unit);
  WriteJson(o.json, {{"name", o.name}, {"value", value}, {"unit", named.r->unit}, {"meaning", named.r->meaning}});
  return kOk;
}

std::vector<std::uint16_t> WordsOf(const Named& named, const std::string& text) {
  const Register& r = *named.r;
  char* end = nullptr;
  const bool hex = text.rfind("0x", 0) == 0;
  const double value =
      hex ? static_cast<double>(std::strtoull(text.c_str(), &end, 16)) : std::strtod(text.c_str(), &end);
  const double most = r.type == RegisterType::kU16 ? 65535 : 4294967295.0;
  const bool number = !text.empty() && *end == '\0' && std::isfinite(value);
  if (!number || (r.type != RegisterType::kF32 && (value < 0 || value > most || value != std::floor(value))))
    throw io::InputError(fmt::format(
        "{}: {}: expected {}", r.name, text,
        r.type == RegisterType::kF32 ? "a finite number" : fmt::format("an integer from 0 to {:.0f}", most)));
  if (r.range.given && (value < r.range.low || value > r.range.high))
    throw io::InputError(fmt::format("{}: {}: expected {:.0f} to {:.0f}", r.name, text, r.range.low, r.range.high));
  std::vector<std::uint16_t> words(link::WordsOf(r.type));
  if (r.type == RegisterType::kU16) words[0] = static_cast<std::uint16_t>(value);
  if (r.type == RegisterType::kU32) core::PutU32(words.data(), static_cast<std::uint32_t>(value));
  if (r.type == RegisterType::kF32) core::PutF32(words.data(), static_cast<float>(value));
  return words;
}

int RunSet(const DeviceOptions& o, ordered_json&) {
  const Named named = Find(o.name);
  const Register& r = *named.r;
  if (r.access != link::Access::kWrite)
    throw io::InputError(fmt::format(
        "{}: {}", o.name,
        r.access == link::Access::kRead ? "can only be read" : "is written with its whole block, by the verb for it"));
  const std::vector<std::uint16_t> words = WordsOf(named, o.value);
  if (named.element < 0 && r.count > 1) throw io::InputError(o.name + ": expected an element, as in " + o.name + "[0]");
  client::DriveClient drive = ConnectTo(o.connect);
  (void)drive.ReadIdentity();  // throws if it is no armcal drive
  std::optional<client::WriterSeat> seat;
  if (std::string(r.name).rfind("learning_", 0) == 0 || std::string(r.name) == "trial_limit") seat.emplace(drive);
  const int at = r + std::max(0, named.element) * link::WordsOf(r.type);
  if (words.size() == 1) drive.WriteSingle(at, words[0]);
  else drive.Write(at, words);
  const ordered_json value = ReadRegister(drive, named);
  fmt::print("{} was set to {}, reads {}\n", o.name, o.value, io::JsonText(value));
  WriteJson(o.json, {{"name", o.name}, {"set", o.value}, {"reads", value}});
  return kOk;
}

// watch --------------------------------------------------------------------------------------------------------------

// Whatever else is on the screen scrolls away; each look is one block of lines.
int RunWatch(const DeviceOptions& o, ordered_json& said) {
  client::DriveClient drive = ConnectTo(o.connect);
  const client::Identity id = drive.ReadIdentity();
  const InterruptGuard guard;
  const bool monitor = (id.capabilities & reg::kHasFilterA) != 0;
  ordered_json& looks = said["readings"] = ordered_json::array();
  for (int look = 0; (o.count == 0 || look < o.count) && !InterruptGuard::interrupted(); ++look) {
    if (look > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    const client::DriveStatus s = drive.ReadStatus();
    ordered_json json{{"tick", s.tick},           {"generation", s.generation},
                      {"health", s.health},       {"enabled_axes", s.enabled_axes},
                      {"clamped", s.clamp_count}, {"sample_gaps", s.sample_gaps}};
    fmt::print("tick {}  generation {}  health {}  enabled 0x{:X}  clamped {}  refused samples {}\n", s.tick,
               s.generation, s.health, s.enabled_axes, s.clamp_count, s.sample_gaps);
    if (monitor) {
      const auto rms = drive.ReadFloats(reg::kResidualRms, id.axes), nis = drive.ReadFloats(reg::kConsistency, id.axes);
      fmt::print("  residual / N*m {:>9.3f}\n  consistency    {:>9.3f}\n", fmt::join(rms, " "), fmt::join(nis, " "));
      json["residual_rms_Nm"] = rms, json["consistency"] = nis;
    }
    std::fflush(stdout);
    if (!o.json.empty()) looks.push_back(json);
  }
  WriteJson(o.json, looks);
  return kOk;
}

// map, scan ----------------------------------------------------------------------------------------------------------

int RunMap(const DeviceOptions& o) {
  const std::string text = o.csv        ? client::RegisterCsv()
                           : o.markdown ? client::RegisterMarkdown()
                                        : client::RegisterJson();
  if (o.json.empty() || o.csv || o.markdown) fmt::print("{}", text);
  if (!o.json.empty()) WriteJson(o.json, io::ParseJson(client::RegisterJson()));
  return kOk;
}

// "PREFIX:FROM" to "PREFIX:TO".
std::vector<std::string> Numbered(const std::string& prefix, int from, int to) {
  if (from > to) throw io::InputError(fmt::format("--from {}: expected at most --to {}", from, to));
  std::vector<std::string> out;
  for (int k = from; k <= to; ++k) out.push_back(fmt::format("{}:{}", prefix, k));
  return out;
}

std::vector<std::string> UnitsToScan(const DeviceOptions& o) {
  const std::optional<SerialAddress> serial = LineAndUnit(o.connect);
  if (!serial || serial->unit != 0)
    throw io::InputError("scan " + o.connect +
                         ": expected DEVICE[:BAUD[:PARITY]], for instance /dev/ttyUSB0:9600:N; 300 to 12000000 baud, "
                         "parity N, E or O; --from and --to say which units");
  for (const auto& [name, unit] : {std::pair{"--from", o.from}, {"--to", o.to}})
    if (unit > kLastUnit)
      throw io::InputError(fmt::format("{} {}: expected a unit from 1 to {} of a serial line", name, unit, kLastUnit));
  return Numbered(fmt::format("{}:{}:{}", serial->line.device, serial->line.baud, serial->line.parity),
                  o.from == 0 ? 1 : o.from, o.to == 0 ? kLastUnit : o.to);
}

// The host may have a port. Without one, and without --from and --to, the two ports are tried that drives usually have.
std::vector<std::string> PortsToScan(const DeviceOptions& o) {
  const std::string& host = o.connect;
  const bool bracket = host.starts_with('['),
             port = bracket ? !host.ends_with(']') : std::count(host.begin(), host.end(), ':') == 1;
  if (port && !HostAndPort(host))
    throw io::InputError("scan " + host + ": expected HOST, HOST:PORT with a port from 1 to 65535, or a serial line");
  if (port && o.from + o.to > 0)
    throw io::InputError("scan " + host + ": has a port; expected a host alone beside --from and --to");
  if (port) return {host};
  if (o.from + o.to == 0) return {fmt::format("{}:{}", host, kModbusPort), fmt::format("{}:{}", host, kSimulatedPort)};
  if (o.from == 0 || o.to == 0)
    throw io::InputError(fmt::format("scan {}: expected --from and --to, the first and the last port", host));
  return Numbered(host, o.from, o.to);
}

// Units of a serial line, or ports of a host. What is found is told at once: the rest may take long.
int RunScan(const DeviceOptions& o, ordered_json& said) {
  const std::vector<std::string> addresses = IsSerialLine(o.connect) ? UnitsToScan(o) : PortsToScan(o);
  ordered_json& found = said["found"] = ordered_json::array();
  std::string last_failure;
  const InterruptGuard guard;
  report::Progress progress("scan");
  for (std::size_t k = 0; k < addresses.size() && !InterruptGuard::interrupted(); ++k) {
    const std::string& address = addresses[k];
    try {
      client::DriveClient drive = ConnectTo(address);
      const client::Identity id = drive.ReadIdentity();
      progress.Clear();
      fmt::print("{}: serial number {}, schema {}, {} axes\n", address, id.serial_number, client::CrcText(id.schema),
                 id.axes);
      std::fflush(stdout);
      found.push_back({{"address", address},
                       {"serial_number", id.serial_number},
                       {"schema", client::CrcText(id.schema)},
                       {"axes", id.axes}});
    } catch (const client::LinkError& error) {
      last_failure = error.what();
    } catch (const client::RefusedError& error) {
      last_failure = error.what();
    }
    progress.Set(static_cast<double>(k + 1) / static_cast<double>(addresses.size()));
  }
  const bool stopped = InterruptGuard::interrupted();
  if (found.empty() && stopped) fmt::print(stderr, "stopped before a drive answered\n");
  if (found.empty() && !stopped) throw client::LinkError("no drive answered; the last failure was: " + last_failure);
  WriteJson(o.json, found);
  return stopped ? kPartial : kOk;
}

CLI::App* Add(CLI::App& app, Action& action, const char* name, const char* help,
              const std::shared_ptr<DeviceOptions>& o, int (*run)(const DeviceOptions&, ordered_json& said),
              bool connects = true) {
  auto* verb = app.add_subcommand(name, help);
  if (connects) verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--json", o->json, "write the result here");
  verb->callback([o, &action, run] { action = Telling(o, run); });
  return verb;
}

}  // namespace

void AddDevice(CLI::App& app, Action& action) {
  const auto options = [] { return std::make_shared<DeviceOptions>(); };
  Add(app, action, "info",
      "what a drive is and does now, and who may write\nexample: armcal info --connect 127.0.0.1:1502", options(),
      RunInfo);
  auto o = options();
  auto* verb = Add(app, action, "get",
                   "read a register by its name\nexample: armcal get generation --connect 127.0.0.1:1502\nexample: "
                   "armcal get estimate_a[3] --connect 127.0.0.1:1502",
                   o, RunGet);
  verb->add_option("name", o->name, kNameHelp)->required();
  o = options();
  verb = Add(app, action, "set",
             "write a register by its name, within its range\nexample: armcal set learning_hold 1 --connect "
             "127.0.0.1:1502",
             o, RunSet);
  verb->add_option("name", o->name, kNameHelp)->required();
  verb->add_option("value", o->value, "number; integers also as 0x1F")->required();
  o = options();
  verb = Add(app, action, "watch",
             "show state, residuals and consistency (normalised innovation squared) once a second, until "
             "Ctrl-C\nexample: armcal watch --connect "
             "127.0.0.1:1502",
             o, RunWatch);
  verb->add_option("--count", o->count, "number of readings (default: until Ctrl-C)")->check(Between(1, 1000000));
  o = options();
  verb = Add(
      app, action, "scan",
      "find drives: units of a serial line, or ports of a host\nexit code 3: no drive answered, 6: stopped by "
      "Ctrl-C\nexample: armcal scan /dev/ttyUSB0:9600:N --to 10\nexample: armcal scan 192.168.0.10\nexample: armcal "
      "scan 192.168.0.10 --from 500 --to 510",
      o, RunScan, false);
  verb->add_option("line", o->connect, "serial line as /dev/ttyUSB0[:115200[:E]], HOST, or HOST:PORT")->required();
  verb->add_option("--from", o->from, "first unit (default: 1), or first port (default: ports 502 and 1502 alone)")
      ->check(Between(1, 65535));
  verb->add_option("--to", o->to, "last unit (default: 247), or last port")->check(Between(1, 65535));
  o = options();
  verb = app.add_subcommand("map", "print the register map of this version\nexample: armcal map --csv > registers.csv");
  auto* json =
      verb->add_option("--json", o->json, "as JSON, into this file, or without one to the terminal")->expected(0, 1);
  auto* csv = verb->add_flag("--csv", o->csv, "as CSV")->excludes(json);
  verb->add_flag("--md", o->markdown, "as the tables of SPEC.md")->excludes(json)->excludes(csv);
  verb->callback([o, &action] { action = [o] { return RunMap(*o); }; });
}

}  // namespace armcal::tool
