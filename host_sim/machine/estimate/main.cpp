// estimate - runs lib's estimators on a PC, on the trace of a drive or on a recorded log. Compiled once for each model.
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include <selected_model.hpp>
#include "armcal/controller/trace_records.hpp"
#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/physical_read_out.hpp"
#include "armcal/link/registers.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::estimate {
namespace {

using Model = generated::SelectedModel;
constexpr int n = Model::kJoints;
using Sample = model::Sample<n>;
using BodyReadOut = physical::MapReadOut<Model, double>;

// Both filters of the firmware on one stream of samples, and the bodies that the Kalman filter's result stands for.
class HostPort {
 public:
  explicit HostPort(const std::vector<std::uint16_t>& words) {
    const int count = static_cast<int>(words.size());
    if (count < model::kHeaderWords ||
        !core::IsOk(model::CheckHeading<n, Model::kParameters>(words.data(), count, Model::kSchema)))
      throw io::InputError("table: not of this model's schema and size");
    const core::Status decoded = model::Decode(words.data(), Model::kSchema, table_);
    if (!core::IsOk(decoded))
      throw io::InputError("table: refused as on the drive, status " + std::to_string(static_cast<int>(decoded)));
    const core::Status built = estimator::BuildAdoptedTable<Model>(table_, 1, *rigid_, *adopted_);
    if (!core::IsOk(built))
      throw io::InputError("table: refused as on the drive, status " + std::to_string(static_cast<int>(built)));
    a_->Adopt(*adopted_, 0);
    b_->Adopt(*adopted_, 0);
  }
  void Add(const Sample& s) {
    Run();
    if (!core::IsOk(a_->PushSample(s)) || !core::IsOk(b_->PushSample(s)))
      throw std::logic_error("host port: its own ring is full");
    Run();
  }
  void Finish() {
    a_->RequestReadOut();
    b_->RequestReadOut();
    Run();
    (void)a_->Take(a);
    (void)b_->Take(b);
    const core::Status begun = estimator::HandOverPhysical(*adopted_, *rigid_, *b_, false, *bodies_);
    if (!core::IsOk(begun))
      throw io::InputError("physical read-out: refused, status " + std::to_string(static_cast<int>(begun)));
    while (!bodies_->Step()) {
    }
  }
  // Changes of the parameters are larger than the table's deviations allow.
  bool prior_too_narrow() const { return estimator::PriorIsTooNarrow(*bodies_); }
  const BodyReadOut::Result& bodies() const { return bodies_->result(); }
  const estimator::Table<Model>& table() const { return table_; }
  estimator::Estimates<Model> a, b;

 private:
  void Run() {
    while (a_->Step()) {
    }
    while (b_->Step()) {
    }
  }
  estimator::Table<Model> table_;
  std::unique_ptr<physical::RigidPrior<Model, float>> rigid_ = std::make_unique<physical::RigidPrior<Model, float>>();
  std::unique_ptr<estimator::AdoptedTable<Model>> adopted_ = std::make_unique<estimator::AdoptedTable<Model>>();
  std::unique_ptr<estimator::Estimator<Model, filter::ForgettingFilter<Model>>> a_ =
      std::make_unique<estimator::Estimator<Model, filter::ForgettingFilter<Model>>>();
  std::unique_ptr<estimator::Estimator<Model, filter::KalmanFilter<Model>>> b_ =
      std::make_unique<estimator::Estimator<Model, filter::KalmanFilter<Model>>>();
  std::unique_ptr<BodyReadOut> bodies_ = std::make_unique<BodyReadOut>();
};

struct Options {
  std::string host, robot, records, log, table, json;
  int port = 0, idle_ms = 2000;
};

std::vector<std::string> ColumnNames(const codegen::Model& m) {
  std::vector<std::string> out;
  for (int c = 0; c < m.columns(); ++c) out.push_back(m.column_name(c));
  return out;
}

nlohmann::ordered_json Json(const codegen::Model& m, const HostPort& port) {
  nlohmann::ordered_json j;
  const auto names = ColumnNames(m);
  for (int c = 0; c < Model::kColumns; ++c)
    j["columns"].push_back({{"name", names[c]},
                            {"forgetting", port.a.value[c]},
                            {"forgetting_sd", port.a.sd[c]},
                            {"kalman", port.b.value[c]},
                            {"kalman_sd", port.b.sd[c]}});
  for (int k = 0; k < Model::kBodyParameters; ++k)
    j["bodies"].push_back({{"name", Model::kInfo[k].name},
                           {"table", port.table().parameter[k].mean},
                           {"value", port.bodies().body[k]},
                           {"sd", port.bodies().body_sd[k]}});
  j["bodies_converged"] = port.bodies().converged;
  j["inconsistent"] = port.b.inconsistent;
  j["prior_too_narrow"] = port.prior_too_narrow();
  j["samples"] = port.a.samples;
  j["gate"]["forgetting"] = {{"rows_used", port.a.rows_used}, {"rows_outside", port.a.rows_outside}};
  j["gate"]["kalman"] = {{"rows_used", port.b.rows_used}, {"rows_outside", port.b.rows_outside}};
  return j;
}

// How many rows the row gate refused: more than a few say that the model or the table's noise is wrong.
void PrintGate(const HostPort& port) {
  const auto share = [](const estimator::Estimates<Model>& e) {
    const double outside = std::accumulate(std::begin(e.rows_outside), std::end(e.rows_outside), 0.0);
    const double used = std::accumulate(std::begin(e.rows_used), std::end(e.rows_used), 0.0);
    return used + outside > 0 ? 100 * outside / (used + outside) : 0;
  };
  fmt::print("Rows outside the gate: forgetting filter {:.2f} %, Kalman filter {:.2f} %\n", share(port.a),
             share(port.b));
}

void PrintBodies(const HostPort& port) {
  fmt::print(
      "\nBodies that can exist, from the Kalman filter and the table; sd of m, centre, I about it:\n{:16} {:>14} "
      "{:>14} {:>12}\n",
      "body", "table", "estimate", "sd");
  for (int k = 0; k < Model::kBodyParameters; ++k)
    fmt::print("{:16} {:14.6g} {:14.6g} {:12.3g}\n", Model::kInfo[k].name, port.table().parameter[k].mean,
               port.bodies().body[k], port.bodies().body_sd[k]);
  if (port.b.inconsistent)
    fmt::print("The torque holds more than the model and its stated noise: every sd is too small.\n");
  if (port.prior_too_narrow())
    fmt::print(
        "The parameters moved further than the table's deviations allow: what the data hardly tell is less certain.\n");
}

// Live: the table in force, then every sample from now on until the drive has been silent for idle_ms.
int Live(const Options& o, const codegen::Model& m) {
  client::DriveClient drive(o.host, o.port);
  const client::Identity id = drive.ReadIdentity();
  if (id.schema != Model::kSchema)
    throw client::RefusedError(fmt::format("{}: runs schema {:08X}, this estimator was compiled for {:08X}",
                                           drive.name(), id.schema, Model::kSchema),
                               0, core::Status::kWrongSchema);
  const std::vector<std::uint16_t> table = client::ReadActiveTable(drive);
  HostPort port(table);
  client::TraceRequest request;
  request.channels = controller::kSampleAll;
  client::StartTrace(drive, 1, request);
  client::TraceReader reader(drive, 1, client::Gaps::kRefuse);
  std::printf("estimate: listening to %s\n", drive.name().c_str());
  std::fflush(stdout);
  client::TraceRecords page;
  std::vector<std::uint16_t> kept_words;
  std::vector<std::uint32_t> kept_ticks;
  std::size_t used = 0;
  auto last = std::chrono::steady_clock::now();
  bool any = false;
  while (!any || std::chrono::steady_clock::now() - last < std::chrono::milliseconds(o.idle_ms)) {
    page.ticks.clear(), page.words.clear(), page.generations.clear();
    if (reader.TakePage(page) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));  // nothing waits on the drive
      continue;
    }
    if (page.lost)
      throw client::LinkError(drive.name() + ": the drive lost samples; the estimate would not be its own");
    for (std::size_t k = 0; k < page.count(); ++k) {
      Sample s;
      float tau_model[n];
      s.tick = page.ticks[k];
      controller::ReadSampleRecord<n>(&page.words[k * page.record_words], s, tau_model);
      for (int j = 0; j < n; ++j) used += (s.flags[j] & model::kUsed) != 0;
      port.Add(s);
    }
    kept_words.insert(kept_words.end(), page.words.begin(), page.words.end());
    kept_ticks.insert(kept_ticks.end(), page.ticks.begin(), page.ticks.end());
    any = true;
    last = std::chrono::steady_clock::now();
  }
  client::TraceRequest off;
  off.mode = client::TraceMode::kOff;
  client::StartTrace(drive, 1, off);
  port.Finish();
  const auto drive_a = drive.ReadFloats(link::reg::kEstimateA, Model::kColumns),
             drive_b = drive.ReadFloats(link::reg::kEstimateB, Model::kColumns);
  const auto drive_sd = drive.ReadFloats(link::reg::kDeviationA, Model::kColumns);
  const bool same_a = !std::memcmp(drive_a.data(), port.a.value, sizeof port.a.value),
             same_b = !std::memcmp(drive_b.data(), port.b.value, sizeof port.b.value);
  const auto names = ColumnNames(m);
  fmt::print("{:16} {:>14} {:>14} {:>12} {:>14} {:>14}\n", "column", "host", "drive", "sd", "host Kalman",
             "drive Kalman");
  for (int c = 0; c < Model::kColumns; ++c)
    fmt::print("{:16} {:14.6g} {:14.6g} {:12.3g} {:14.6g} {:14.6g}\n", names[c], port.a.value[c], drive_a[c],
               drive_sd[c], port.b.value[c], drive_b[c]);
  PrintBodies(port);
  fmt::print("{} samples, {} rows used; forgetting filter {} the drive's, Kalman filter {} the drive's\n",
             port.a.samples, used, same_a ? "bit for bit" : "DIFFERS from", same_b ? "bit for bit" : "DIFFERS from");
  if (!o.records.empty()) {  // raw words, for a check by another program: count, record words, table words, then
                             // tables, ticks, records
    std::string text;
    const auto put = [&](const void* p, std::size_t bytes) { text.append(static_cast<const char*>(p), bytes); };
    const std::uint32_t head[] = {static_cast<std::uint32_t>(kept_ticks.size()), page.record_words,
                                  static_cast<std::uint32_t>(table.size())};
    put(head, sizeof head);
    put(table.data(), 2 * table.size());
    put(kept_ticks.data(), 4 * kept_ticks.size());
    put(kept_words.data(), 2 * kept_words.size());
    put(drive_a.data(), 4 * drive_a.size());
    put(drive_sd.data(), 4 * drive_sd.size());
    files::WriteWholeFile(o.records, text);
  }
  if (!o.json.empty()) {
    nlohmann::ordered_json j = Json(m, port);
    j["drive_forgetting"] = drive_a, j["drive_kalman"] = drive_b;
    j["rows_used"] = used, j["same_bits"] = same_a, j["same_bits_kalman"] = same_b;
    files::WriteWholeFile(o.json, j.dump(1) + "\n");
  }
  return same_a ? 0 : 5;
}

// A recorded log: speeds and accelerations from the host's zero-phase derivatives.
int FromLog(const Options& o, const codegen::Model& m) {
  const calibration::TableFile table = o.table.empty() ? calibration::DefaultTable(m) : calibration::ReadTable(o.table);
  HostPort port(calibration::EncodeTable(table));
  const calibration::Dataset d = calibration::Prepare(m, logs::ReadLog(o.log));
  for (int k = 0; k < d.samples(); k += d.per_sample) {
    Sample s;
    s.tick = static_cast<std::uint32_t>(std::lround(d.s.t[k] * m.robot().tick_rate_Hz));
    for (int j = 0; j < n; ++j) {
      s.q[j] = static_cast<float>(d.s.q(k, j)), s.qd[j] = static_cast<float>(d.s.qd(k, j)),
      s.qdd[j] = static_cast<float>(d.s.qdd(k, j));
      s.tau[j] = static_cast<float>(table.joint[j].torque_scale * d.tau(k, j));
      s.temperature_degC[j] = d.s.temp.cols() > j ? static_cast<float>(d.s.temp(k, j)) : 0.0f;
      s.flags[j] = d.used(k, j) ? model::kValid | model::kMoving : 0;
    }
    port.Add(s);
  }
  port.Finish();
  const auto names = ColumnNames(m);
  fmt::print("{:16} {:>14} {:>12} {:>14} {:>12}\n", "column", "forgetting", "sd", "Kalman", "sd");
  for (int c = 0; c < Model::kColumns; ++c)
    fmt::print("{:16} {:14.6g} {:12.3g} {:14.6g} {:12.3g}\n", names[c], port.a.value[c], port.a.sd[c], port.b.value[c],
               port.b.sd[c]);
  PrintBodies(port);
  PrintGate(port);
  if (!o.json.empty()) files::WriteWholeFile(o.json, Json(m, port).dump(1) + "\n");
  return 0;
}

int Main(int argc, char** argv) {
  Options o;
  std::string effects;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--host") o.host = value;
    else if (key == "--port") o.port = std::stoi(value);
    else if (key == "--robot") o.robot = value;
    else if (key == "--effects") effects = value;
    else if (key == "--log") o.log = value;
    else if (key == "--table") o.table = value;
    else if (key == "--records") o.records = value;
    else if (key == "--json") o.json = value;
    else throw io::InputError(key + ": no such option of the estimator");
  }
  const codegen::Model m(codegen::ReadRobot(o.robot), codegen::ReadCatalogue(effects));
  if (calibration::DefaultTable(m).schema != Model::kSchema)
    throw io::InputError(o.robot + ": not the robot file that this estimator was compiled for");
  return o.log.empty() ? Live(o, m) : FromLog(o, m);
}

}  // namespace
}  // namespace armcal::estimate

int main(int argc, char** argv) {
  const auto fail = [](const std::exception& e, int code) {
    return std::fprintf(stderr, "armcal estimate: %s\n", e.what()), code;
  };
  try {
    return armcal::estimate::Main(argc, argv);
  } catch (const armcal::client::LinkError& e) {
    return fail(e, 3);
  } catch (const armcal::client::RefusedError& e) {
    return fail(e, 4);
  } catch (const std::exception& e) {
    return fail(e, 2);
  }
}
