// tool - armcal record: writes the traces of a drive as logs, and prints how the arm moved.
#include <fmt/core.h>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/recording.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/interrupt.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

using Eigen::VectorXd;

// Root mean square over samples where `use` holds, per joint; the first and last half second are left out.
template <class Value, class Use>
VectorXd RmsOf(const logs::Log& log, Value value, Use use) {
  VectorXd out = VectorXd::Zero(log.joints);
  for (int j = 0; j < log.joints; ++j) {
    double sum = 0;
    int count = 0;
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (log.t[k] < log.t[0] + 0.5 || log.t[k] > log.t[log.samples() - 1] - 0.5 || !use(k, j)) continue;
      sum += value(k, j) * value(k, j);
      ++count;
    }
    out[j] = count ? std::sqrt(sum / count) : 0;
  }
  return out;
}

// "work.csv.gz" gives "work.partial.csv.gz", so that nobody takes it for a whole recording. A device stays: no file may
// lie beside it.
std::string PartialPath(const std::string& path) {
  if (path.empty() || (std::filesystem::exists(path) && !std::filesystem::is_regular_file(path))) return path;
  const auto name = path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1;
  const auto dot = std::min(path.find('.', name), path.size());
  return path.substr(0, dot) + ".partial" + path.substr(dot);
}

int RunRecord(const client::RecordOptions& o) {
  const codegen::Model model = LoadModel(o.robot);
  const codegen::Robot& robot = model.robot();
  const int n = robot.joints();
  if (o.trajectory.empty() == (o.seconds == 0)) throw io::InputError("record: expected --trajectory or --seconds");
  client::DriveClient drive = ConnectTo(o.connect);
  const InterruptGuard guard;
  client::RecordOptions options = o;
  options.schema = codegen::Schema(model);
  options.interrupted = &InterruptGuard::interrupted();
  const client::Recording recording = Record(drive, options, robot);
  const bool partial = !recording.cut.empty();
  const std::string out = partial ? PartialPath(o.out) : o.out,
                    samples_out = partial ? PartialPath(o.samples) : o.samples;
  const client::TraceRecords &raw = recording.raw, &samples = recording.samples;
  const client::PlayedTicks& played_ticks = recording.played;

  std::uint32_t first_tick = 0;
  const logs::Log log = client::RawLog(raw, robot, played_ticks, first_tick);
  logs::WriteLog(out, log);
  nlohmann::ordered_json json{{"log", out},
                              {"first_tick", first_tick},
                              {"decimation", raw.tick_step},
                              {"samples", log.samples()},
                              {"partial", partial},
                              {"wanted_decimation", recording.wanted_decimation},
                              {"packed", recording.packed},
                              {"positions_not_told", recording.unknown},
                              {"repeated_requests", recording.failed_attempts},
                              {"schema", client::CrcText(recording.schema)},
                              {"robot_schema", client::CrcText(options.schema)}};
  report::Table table{{"joint", "moving / %"}, {}};
  VectorXd tracking;
  if (log.qref.size() > 0) {
    const auto always = [](Eigen::Index, int) { return true; };
    tracking = RmsOf(
        log, [&](Eigen::Index k, int j) { return log.q(k, j) - log.qref(k, j); }, always);
    json["tracking_rms_rad"] = verdict::ToList(tracking);
    table.header.insert(table.header.end(), {"tracking error rms", "unit"});
  }
  const auto v_min = [&](int j) { return robot.joint[j].v_min_radps; };
  VectorXd residual;
  if (!o.samples.empty()) {
    logs::WriteLog(samples_out, client::SampleLog(samples, robot, played_ticks, true));
    const logs::Log played = client::SampleLog(samples, robot, played_ticks, false);
    residual = RmsOf(
        played, [&](Eigen::Index k, int j) { return played.tau(k, j) - played.tauff(k, j); },
        [&](Eigen::Index k, int j) { return std::abs(played.qd(k, j)) > v_min(j); });
    json["drive_residual_rms_Nm"] = verdict::ToList(residual);
    json["generation"] = samples.generations.empty() ? 0 : samples.generations.back();
    table.header.insert(table.header.end(), {"measured - committed model", "unit"});
  }
  for (int j = 0; j < n; ++j) {
    int moving = 0;
    for (Eigen::Index k = 1; k < log.samples(); ++k)
      moving += std::abs(log.q(k, j) - log.q(k - 1, j)) > v_min(j) * (log.t[k] - log.t[k - 1]);
    table.rows.push_back(
        {std::to_string(j + 1), fmt::format("{:.0f}", 100.0 * moving / static_cast<double>(log.samples()))});
    std::vector<std::string>& row = table.rows.back();
    const codegen::Joint& joint = robot.joint[static_cast<std::size_t>(j)];
    if (tracking.size() > 0)
      row.insert(row.end(), {fmt::format("{:.3f}", 1e3 * tracking[j]), calibration::Slides(joint) ? "mm" : "mrad"});
    if (residual.size() > 0)
      row.insert(row.end(), {fmt::format("{:.3f}", residual[j]), calibration::TorqueUnit(joint)});
  }
  fmt::print("{}: {} samples, {:.1f} s, {}\n{}", out, log.samples(), log.t[log.samples() - 1],
             partial ? "a part of the recording" : "none lost", report::Text(table));
  if (recording.unknown > 0)
    fmt::print(
        "{} positions of packed records could not be told and are marked stale: the arm moved too fast for them, or "
        "the part between two gaps is too short\n",
        recording.unknown);
  if (!partial) {
    WriteJson(o.json, json);
    return kOk;
  }
  json["error"] = recording.cut;
  const int code = *options.interrupted ? kInterrupted : kPartial;
  json["exit_code"] = code;
  WriteJson(o.json, json);
  fmt::print(stderr, "armcal: {}; the longest part without a gap is in {}\n", recording.cut, out);
  return code;
}

}  // namespace

void AddRecord(CLI::App& app, Action& action) {
  auto* verb =
      app.add_subcommand("record",
                         "record a drive's trace: of a trajectory that the (simulated) drive plays, or of what its own "
                         "controller does\nexample: armcal record --connect 127.0.0.1:1502 --robot er20_like "
                         "--trajectory train.csv --out train_log.csv.gz\nexample: armcal record --connect "
                         "/dev/ttyUSB0:115200 --robot er20_like --seconds 60 --lean --out work.csv.gz");
  auto o = std::make_shared<client::RecordOptions>();
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  auto* trajectory =
      verb->add_option("--trajectory", o->trajectory, "trajectory of armcal excite, for a drive that plays it");
  verb->add_option("--seconds", o->seconds,
                   "record for this many seconds whatever the arm does, instead of a trajectory")
      ->check(Between(1.0, 86400.0));
  verb->add_flag("--lean", o->lean,
                 "position, current and flags only, for a serial line; packed records if the drive has them");
  verb->add_option("--out", o->out, "log to write (.csv or .csv.gz)")->required();
  verb->add_option("--samples", o->samples,
                   "also write the drive's processed samples, with the committed model's torque as tauff");
  verb->add_option("--speed", o->speed_percent, "percent of the trajectory's speed, for a first slow pass")
      ->capture_default_str()
      ->check(Between(1, 100))
      ->needs(trajectory);
  verb->add_option("--decimation", o->decimation,
                   "ticks averaged into one record (default: the estimator's; 1 keeps gear ripple)")
      ->check(Between(1, 16));
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, &action] { action = [o] { return Reported(o->json, [&] { return RunRecord(*o); }); }; });
}

}  // namespace armcal::tool
