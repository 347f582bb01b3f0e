// tool - armcal estimate: runs the firmware's estimators on the live trace of a drive or on a recorded log.
#include <dlfcn.h>
#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <numeric>
#include <thread>

#include "armcal/controller/trace_records.hpp"
#include "armcal/link/registers.hpp"
#include "armcal/model/sample.hpp"
#include "codegen/src/generator/emit.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/machine/estimate/estimators.hpp"
#include "host_sim/tool/compiled_firmware.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

using estimate::Estimators;
using estimate::FilterResult;

struct EstimateOptions {
  std::string connect, robot, log, table, records, json;
  LogFormat format;
};

// Without a sample for so long, the motion is over.
constexpr auto kSilence = std::chrono::seconds(2);

// Those that are linked in, if they are this model's, or a shared object from the cache. It is never unloaded.
std::unique_ptr<Estimators> EstimatorsFor(const codegen::Model& model) {
  std::unique_ptr<Estimators> own(MakeArmcalEstimators(estimate::kEstimatorsInterface));
  if (own->schema() == codegen::Schema(model)) return own;
  const std::string path = CompiledFirmware(model, FirmwarePart::kEstimators).string();
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw io::InputError(dlerror());
  const auto make = reinterpret_cast<decltype(&MakeArmcalEstimators)>(dlsym(library, "MakeArmcalEstimators"));
  std::unique_ptr<Estimators> loaded(make ? make(estimate::kEstimatorsInterface) : nullptr);
  if (!loaded) throw io::InputError(path + ": expected estimators that this armcal has compiled");
  return loaded;
}

bool SameBits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void ThrowIf(const std::string& wrong) {
  if (!wrong.empty()) throw io::InputError(wrong);
}

nlohmann::ordered_json Json(const codegen::Model& model, const Estimators& port) {
  nlohmann::ordered_json json;
  const FilterResult a = port.forgetting(), b = port.kalman();
  const estimate::BodiesResult bodies = port.physical();
  for (int c = 0; c < port.columns(); ++c)
    json["columns"].push_back({{"name", model.column_name(c)},
                               {"forgetting", a.value[c]},
                               {"forgetting_sd", a.sd[c]},
                               {"kalman", b.value[c]},
                               {"kalman_sd", b.sd[c]}});
  for (int k = 0; k < port.bodies(); ++k)
    json["bodies"].push_back({{"name", port.body_name(k)},
                              {"table", port.body_in_table(k)},
                              {"value", bodies.value[k]},
                              {"sd", bodies.sd[k]}});
  json["bodies_converged"] = bodies.converged;
  json["inconsistent"] = b.inconsistent;
  json["prior_too_narrow"] = bodies.prior_too_narrow;
  json["samples"] = a.samples;
  for (const auto& [name, filter] : {std::pair{"forgetting", a}, {"kalman", b}}) {
    const auto list = [&](const std::uint32_t* rows) { return std::vector<std::uint32_t>(rows, rows + port.joints()); };
    json["gate"][name] = {{"rows_used", list(filter.rows_used)}, {"rows_outside", list(filter.rows_outside)}};
  }
  return json;
}

// How many rows the row gate refused: more than a few say that the model or the table's noise is wrong.
void PrintGate(const Estimators& port) {
  const auto share = [&port](const FilterResult& f) {
    const double outside = std::accumulate(f.rows_outside, f.rows_outside + port.joints(), 0.0);
    const double used = std::accumulate(f.rows_used, f.rows_used + port.joints(), 0.0);
    return used + outside > 0 ? 100 * outside / (used + outside) : 0;
  };
  fmt::print("Rows outside the gate: forgetting filter {:.2f} %, Kalman filter {:.2f} %\n", share(port.forgetting()),
             share(port.kalman()));
}

void PrintBodies(const Estimators& port) {
  const estimate::BodiesResult bodies = port.physical();
  fmt::print(
      "\nBodies that can exist, from the Kalman filter and the table; sd of m, centre, I about it:\n{:16} {:>14} "
      "{:>14} {:>12}\n",
      "body", "table", "estimate", "sd");
  for (int k = 0; k < port.bodies(); ++k)
    fmt::print("{:16} {:14.6g} {:14.6g} {:12.3g}\n", port.body_name(k), port.body_in_table(k), bodies.value[k],
               bodies.sd[k]);
  if (port.kalman().inconsistent)
    fmt::print("The torque holds more than the model and its stated noise: every sd is too small.\n");
  if (bodies.prior_too_narrow)
    fmt::print(
        "The parameters moved further than the table's deviations allow: what the data hardly tell is less certain.\n");
}

// What the drive sent and what it made of it, as words, for a check by another program: counts of ticks, of words of a
// record and of words of the table; the table; ticks; records; the drive's estimate and its deviations.
void WriteRecords(const std::string& path, const std::vector<std::uint16_t>& table,
                  const std::vector<std::uint32_t>& ticks, const std::vector<std::uint16_t>& words,
                  const std::vector<float>& estimate, const std::vector<float>& sd) {
  std::string text;
  const auto put = [&text](const auto& list) {
    text.append(reinterpret_cast<const char*>(list.data()), sizeof list[0] * list.size());
  };
  const std::size_t record_words = ticks.empty() ? 0 : words.size() / ticks.size();
  put(std::vector<std::uint32_t>{static_cast<std::uint32_t>(ticks.size()), static_cast<std::uint32_t>(record_words),
                                 static_cast<std::uint32_t>(table.size())});
  put(table), put(ticks), put(words), put(estimate), put(sd);
  files::WriteWholeFile(path, text);
}

// The table in force, then every sample from now on until the drive falls silent.
int Live(const EstimateOptions& o, const codegen::Model& model) {
  if (IsSerialLine(o.connect))
    throw io::InputError("--connect " + o.connect + ": expected HOST:PORT; a serial line cannot carry every sample");
  client::DriveClient drive = ConnectTo(o.connect);
  (void)LayoutOf(drive, model);  // throws if the drive runs another model
  const std::unique_ptr<Estimators> port = EstimatorsFor(model);
  const std::vector<std::uint16_t> table = client::ReadActiveTable(drive);
  ThrowIf(port->Start(table.data(), static_cast<int>(table.size())));
  const std::uint32_t before = drive.ReadValue<link::reg::kRowsUsedA>();
  client::TraceRequest request;
  request.channels = controller::kSampleAll;
  client::StartTrace(drive, 1, request);
  client::TraceReader reader(drive, 1, client::Gaps::kRefuse);
  fmt::print("estimate: listening to {}; start the motion now\n", drive.name());
  std::fflush(stdout);
  client::TraceRecords page;
  std::vector<std::uint16_t> words;
  std::vector<std::uint32_t> ticks;
  int used = 0;
  auto last = std::chrono::steady_clock::now();
  while (ticks.empty() || std::chrono::steady_clock::now() - last < kSilence) {
    page.ticks.clear(), page.words.clear(), page.generations.clear();
    if (reader.TakePage(page) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));  // nothing waits on the drive
      continue;
    }
    if (page.lost)
      throw client::LinkError(drive.name() + ": the drive lost samples; the estimate would not be its own");
    for (std::size_t k = 0; k < page.count(); ++k)
      used += port->AddRecord(page.ticks[k], &page.words[k * page.record_words]);
    words.insert(words.end(), page.words.begin(), page.words.end());
    ticks.insert(ticks.end(), page.ticks.begin(), page.ticks.end());
    last = std::chrono::steady_clock::now();
  }
  client::TraceRequest off;
  off.mode = client::TraceMode::kOff;
  client::StartTrace(drive, 1, off);
  ThrowIf(port->Finish());
  const auto drive_a = drive.ReadFloats(link::reg::kEstimateA, port->columns()),
             drive_b = drive.ReadFloats(link::reg::kEstimateB, port->columns()),
             drive_sd = drive.ReadFloats(link::reg::kDeviationA, port->columns());
  const FilterResult a = port->forgetting(), b = port->kalman();
  const bool same_a = std::equal(drive_a.begin(), drive_a.end(), a.value, SameBits),
             same_b = std::equal(drive_b.begin(), drive_b.end(), b.value, SameBits);
  fmt::print("{:16} {:>14} {:>14} {:>12} {:>14} {:>14}\n", "column", "host", "drive", "sd", "host Kalman",
             "drive Kalman");
  for (int c = 0; c < port->columns(); ++c)
    fmt::print("{:16} {:14.6g} {:14.6g} {:12.3g} {:14.6g} {:14.6g}\n", model.column_name(c), a.value[c], drive_a[c],
               drive_sd[c], b.value[c], drive_b[c]);
  PrintBodies(*port);
  fmt::print("{} samples, {} rows used; forgetting filter {} the drive's, Kalman filter {} the drive's\n", a.samples,
             used, same_a ? "bit for bit" : "DIFFERS from", same_b ? "bit for bit" : "DIFFERS from");
  if (before > 0)
    fmt::print("The drive had learnt from {} rows before this began. To compare bits, flash a table first.\n", before);
  if (!o.records.empty()) WriteRecords(o.records, table, ticks, words, drive_a, drive_sd);
  nlohmann::ordered_json json = Json(model, *port);
  json["drive_forgetting"] = drive_a, json["drive_kalman"] = drive_b;
  json["rows_before"] = before, json["rows_used"] = used, json["same_bits"] = same_a, json["same_bits_kalman"] = same_b;
  WriteJson(o.json, json);
  return same_a ? kOk : kMismatch;
}

// A recorded log: speeds and accelerations from the host's zero-phase derivatives.
int FromLog(const EstimateOptions& o, const codegen::Model& model) {
  const calibration::TableFile table =
      o.table.empty() ? calibration::DefaultTable(model) : calibration::ReadTable(o.table);
  const calibration::Dataset log = LogReader(model, o.format).One(o.log);
  const std::unique_ptr<Estimators> port = EstimatorsFor(model);
  const std::vector<std::uint16_t> words = calibration::EncodeTable(table);
  ThrowIf(port->Start(words.data(), static_cast<int>(words.size())));
  const int n = port->joints();
  std::vector<float> q(n), qd(n), qdd(n), tau(n), temperature_degC(n);
  std::vector<std::uint8_t> flags(n);
  for (int k = 0; k < log.samples(); k += log.per_sample) {
    for (int j = 0; j < n; ++j) {
      q[j] = static_cast<float>(log.s.q(k, j)), qd[j] = static_cast<float>(log.s.qd(k, j)),
      qdd[j] = static_cast<float>(log.s.qdd(k, j));
      tau[j] = static_cast<float>(table.joint[j].torque_scale * log.tau(k, j));
      temperature_degC[j] = log.s.temp.cols() > j ? static_cast<float>(log.s.temp(k, j)) : 0.0f;
      flags[j] = log.used(k, j) ? model::kValid | model::kMoving : 0;
    }
    const auto tick = static_cast<std::uint32_t>(std::lround(log.s.t[k] * model.robot().tick_rate_Hz));
    port->Add({tick, q.data(), qd.data(), qdd.data(), tau.data(), temperature_degC.data(), flags.data()});
  }
  ThrowIf(port->Finish());
  const FilterResult a = port->forgetting(), b = port->kalman();
  fmt::print("{:16} {:>14} {:>12} {:>14} {:>12}\n", "column", "forgetting", "sd", "Kalman", "sd");
  for (int c = 0; c < port->columns(); ++c)
    fmt::print("{:16} {:14.6g} {:12.3g} {:14.6g} {:12.3g}\n", model.column_name(c), a.value[c], a.sd[c], b.value[c],
               b.sd[c]);
  PrintBodies(*port);
  PrintGate(*port);
  WriteJson(o.json, Json(model, *port));
  return kOk;
}

int RunEstimate(const EstimateOptions& o) {
  if (o.connect.empty() == o.log.empty()) throw io::InputError("estimate: expected either --connect or --log");
  const codegen::Model model = LoadModel(o.robot);
  return o.log.empty() ? Reported(o.json, [&] { return Live(o, model); }) : FromLog(o, model);
}

}  // namespace

void AddEstimate(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "estimate",
      "run the firmware's estimators here, on the drive's live trace or on a log; for a robot that armcal was not "
      "built "
      "with they are compiled once, with g++\nexit code 5: the drive's forgetting filter has other estimates\nexample: "
      "armcal estimate "
      "--connect 127.0.0.1:1502 --robot er20_like");
  auto o = std::make_shared<EstimateOptions>();
  verb->add_option("--connect", o->connect,
                   "drive, HOST:PORT: every sample from now on, until it falls silent for two seconds");
  verb->add_option("--log", o->log, "a recorded log instead");
  AddLogFormat(*verb, o->format);
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  verb->add_option("--table", o->table, "with --log: parameter table to start from (default: the robot file's)");
  verb->add_option("--records", o->records, "keep the table, the samples and the drive's estimate as raw words");
  verb->add_option("--json", o->json, "write the estimates here");
  verb->callback([o, &action] { action = [o] { return RunEstimate(*o); }; });
}

}  // namespace armcal::tool
