// tool - armcal record: writes the traces of a drive as logs, and prints how the arm moved.
#include <fmt/core.h>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/recording.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/tool/connect.hpp"
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

std::vector<double> List(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

int RunRecord(const client::RecordOptions& o) {
  const codegen::Robot robot = codegen::ReadRobot(RobotPath(o.robot));
  const int n = robot.joints();
  if (o.trajectory.empty() == (o.seconds == 0)) throw io::InputError("record: expected --trajectory or --seconds");
  client::DriveClient drive = ConnectTo(o.connect);
  const client::Recording recording = Record(drive, o, robot);
  const client::TraceRecords &raw = recording.raw, &samples = recording.samples;
  const client::PlayedTicks& played_ticks = recording.played;

  std::uint32_t first_tick = 0;
  const logs::Log log = client::RawLog(raw, robot, played_ticks, first_tick);
  logs::WriteLog(o.out, log);
  nlohmann::ordered_json json{
      {"log", o.out}, {"first_tick", first_tick}, {"decimation", raw.tick_step}, {"samples", log.samples()}};
  report::Table table{{"joint", "moving / %"}, {}};
  VectorXd tracking;
  if (log.qref.size() > 0) {
    const auto always = [](Eigen::Index, int) { return true; };
    tracking = RmsOf(
        log, [&](Eigen::Index k, int j) { return log.q(k, j) - log.qref(k, j); }, always);
    json["tracking_rms_rad"] = List(tracking);
    table.header.push_back("tracking error rms / mrad");
  }
  const auto v_min = [&](int j) { return robot.joint[j].v_min_radps; };
  VectorXd residual;
  if (!o.samples.empty()) {
    logs::WriteLog(o.samples, client::SampleLog(samples, robot, played_ticks, true));
    const logs::Log played = client::SampleLog(samples, robot, played_ticks, false);
    residual = RmsOf(
        played, [&](Eigen::Index k, int j) { return played.tau(k, j) - played.tauff(k, j); },
        [&](Eigen::Index k, int j) { return std::abs(played.qd(k, j)) > v_min(j); });
    json["drive_residual_rms_Nm"] = List(residual);
    json["generation"] = samples.generations.empty() ? 0 : samples.generations.back();
    table.header.push_back("measured - committed model / N m");
  }
  for (int j = 0; j < n; ++j) {
    int moving = 0;
    for (Eigen::Index k = 1; k < log.samples(); ++k)
      moving += std::abs(log.q(k, j) - log.q(k - 1, j)) > v_min(j) * (log.t[k] - log.t[k - 1]);
    table.rows.push_back(
        {std::to_string(j + 1), fmt::format("{:.0f}", 100.0 * moving / static_cast<double>(log.samples()))});
    if (tracking.size() > 0) table.rows.back().push_back(fmt::format("{:.3f}", 1e3 * tracking[j]));
    if (residual.size() > 0) table.rows.back().push_back(fmt::format("{:.3f}", residual[j]));
  }
  fmt::print("{}: {} samples, {:.1f} s, none lost\n{}", o.out, log.samples(), log.t[log.samples() - 1],
             report::Text(table));
  WriteJson(o.json, json);
  return kOk;
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
  verb->add_option("--trajectory", o->trajectory, "trajectory of armcal excite, for a drive that plays it");
  verb->add_option("--seconds", o->seconds, "instead: so long, whatever the arm does")->check(CLI::Range(1.0, 86400.0));
  verb->add_flag("--lean", o->lean, "position, current and flags only: half the words, for a serial line");
  verb->add_option("--out", o->out, "log to write (.csv or .csv.gz)")->required();
  verb->add_option("--samples", o->samples,
                   "also write the drive's processed samples, with the committed model's torque as tauff");
  verb->add_option("--speed", o->speed_percent, "percent of the trajectory's speed, for a first slow pass")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  verb->add_option("--decimation", o->decimation,
                   "ticks averaged into one record (default: the estimator's; 1 keeps gear ripple)")
      ->check(CLI::Range(1, 16));
  verb->add_option("--json", o->json, "write the figures here");
  verb->callback([o, &action] { action = [o] { return RunRecord(*o); }; });
}

}  // namespace armcal::tool
