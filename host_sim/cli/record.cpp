// cli - armcal record: plays a trajectory on the drive and brings its traces home as logs.
#include <fmt/core.h>
#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include <Eigen/LU>

#include "armcal/estimator/trace_records.hpp"
#include "host_sim/cli/connect.hpp"
#include "host_sim/cli/trace_log.hpp"
#include "host_sim/cli/verb.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/drive/vendor_registers.hpp"
#include "host_sim/excitation/trajectory.hpp"
#include "host_sim/io/input_error.hpp"
#include "host_sim/io/log.hpp"
#include "host_sim/report/progress.hpp"
#include "host_sim/report/table.hpp"

namespace armcal::cli {
namespace {

namespace words = model::words;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct RecordOptions {
  std::string connect, robot, trajectory, out, samples, json;
  int speed_percent = 100, decimation = 0;
};

struct Player {
  drive::PlayerState state;
  drive::StopReason reason;
  std::uint32_t points, first_tick, last_tick;
  bool moving() const { return state == drive::PlayerState::kBlending || state == drive::PlayerState::kPlaying; }
};

Player ReadPlayer(client::DriveClient& drive) {
  const auto w = drive.ReadInput(drive::kPlayerStatus, drive::kPlayerStatusCount);
  return {static_cast<drive::PlayerState>(w[0]), static_cast<drive::StopReason>(w[1]), words::GetU32(&w[2]),
          words::GetU32(&w[4]), words::GetU32(&w[6])};
}

void Upload(client::DriveClient& drive, const excitation::Trajectory& t) {
  const int n = t.joints(), points = static_cast<int>(t.q.rows()), chunk = (drive::kPlayerPointsCount - 2) / (2 * n);
  std::uint16_t setup[4];
  words::PutU32(setup, points);
  words::PutU32(setup + 2, static_cast<std::uint32_t>(std::lround(t.step_s * 1e6)));
  drive.Write(drive::kPlayerSetup, setup);
  report::Progress progress("load trajectory");
  std::vector<std::uint16_t> w;
  for (int first = 0; first < points; first += chunk) {
    const int count = std::min(chunk, points - first);
    w.assign(2 + 2 * n * count, 0);
    words::PutU32(w.data(), first);
    for (int k = 0; k < count * n; ++k) words::PutF32(&w[2 + 2 * k], static_cast<float>(t.q(first + k / n, k % n)));
    drive.Write(drive::kPlayerPoints, w);
    progress.Set(static_cast<double>(first + count) / points);
  }
}

// Waits (the drive's own time decides, not ours) until `done` says so; ten seconds without it is a broken drive.
template <class Done>
void WaitFor(client::DriveClient& drive, const char* what, Done done) {
  for (int k = 0; k < 2000; ++k) {
    if (done()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  throw client::LinkError(drive.name() + ": waited in vain for: " + what);
}

// Root mean square over samples where `use` holds, per joint; the first and last half second are left out.
template <class Value, class Use>
VectorXd RmsOf(const io::Log& log, Value value, Use use) {
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

std::string Describe(const Player& p) {
  switch (p.reason) {
    case drive::StopReason::kTrackingError:
      return "tracking error";
    case drive::StopReason::kNoTrajectory:
      return "no trajectory";
    case drive::StopReason::kCommand:
      return "stop command";
    case drive::StopReason::kNone:
      break;
  }
  return "no reason given";
}

int RunRecord(const RecordOptions& o) {
  const codegen::Robot robot = codegen::ReadRobot(RobotPath(o.robot));
  const int n = robot.joints(), decimation = o.decimation > 0 ? o.decimation : robot.sample_ticks;
  const excitation::Trajectory trajectory = excitation::ReadTrajectory(o.trajectory, n);
  client::DriveClient drive = ConnectTo(o.connect);
  const client::Identity id = drive.ReadIdentity();
  if (id.axes != n)
    throw io::InputError(fmt::format("{}: {} axes, robot {} has {}", drive.name(), id.axes, robot.name, n));
  Upload(drive, trajectory);
  drive.WriteSingle(drive::kPlayerSpeed, static_cast<std::uint16_t>(o.speed_percent));
  drive.WriteSingle(drive::kPlayerCommand, static_cast<std::uint16_t>(drive::PlayerCommand::kEnable));
  WaitFor(drive, "axes enabled", [&] { return ReadPlayer(drive).state != drive::PlayerState::kDisabled; });
  // windows of the trace and of the drive's own samples are the same ticks
  const std::uint32_t start = (drive.ReadStatus().tick / robot.sample_ticks + 2) * robot.sample_ticks;
  client::TraceRequest request;
  request.decimation = static_cast<std::uint16_t>(decimation);
  request.start_tick = start;
  request.channels = estimator::kRawAll;
  client::ArmTrace(drive, 0, request);
  client::TraceRecords raw, samples;
  client::TraceReader raw_reader(drive, 0);
  std::unique_ptr<client::TraceReader> sample_reader;
  if (!o.samples.empty()) {
    client::TraceRequest all;
    all.channels = estimator::kSampleAll;
    client::ArmTrace(drive, 1, all);
    sample_reader = std::make_unique<client::TraceReader>(drive, 1);
  }
  drive.WriteSingle(drive::kPlayerCommand, static_cast<std::uint16_t>(drive::PlayerCommand::kStart));
  Player player;
  {
    report::Progress progress("record");
    int quiet = 0;  // looks in a row that found nothing after the motion
    for (bool moved = false; quiet < 10;) {
      const std::size_t got = raw_reader.TakePage(raw) + (sample_reader ? sample_reader->TakePage(samples) : 0);
      player = ReadPlayer(drive);
      moved = moved || player.moving() || player.state == drive::PlayerState::kFinished ||
              player.state == drive::PlayerState::kStopped;
      if (player.state == drive::PlayerState::kPlaying && !raw.ticks.empty())
        progress.Set(
            std::max(0.0, static_cast<double>(static_cast<std::int32_t>(raw.ticks.back() - player.first_tick)) /
                              robot.tick_rate_Hz / trajectory.duration_s() * o.speed_percent / 100));
      quiet = moved && !player.moving() && got == 0 ? quiet + 1 : 0;
      if (got == 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // nothing waits on the drive: let it run
    }
  }
  client::TraceRequest off;
  off.mode = client::TraceMode::kOff;
  client::ArmTrace(drive, 0, off);
  if (sample_reader) client::ArmTrace(drive, 1, off);
  drive.WriteSingle(drive::kPlayerCommand, static_cast<std::uint16_t>(drive::PlayerCommand::kDisable));
  WaitFor(drive, "axes disabled", [&] { return ReadPlayer(drive).state == drive::PlayerState::kDisabled; });
  if (player.state == drive::PlayerState::kStopped)
    throw client::RefusedError(drive.name() + ": the motion was stopped: " + Describe(player), 0, core::Status::kHeld);
  if (raw.lost || samples.lost)
    throw client::LinkError(
        fmt::format("{}: the drive lost {} trace records because the link was too slow; nothing is glued over a gap",
                    drive.name(), raw.lost + samples.lost));

  std::uint32_t first_tick = 0;
  const io::Log log = RawLog(raw, robot, {player.first_tick, player.last_tick}, first_tick);
  io::WriteLog(o.out, log);
  const auto always = [](Eigen::Index, int) { return true; };
  const VectorXd tracking = RmsOf(
      log, [&](Eigen::Index k, int j) { return log.q(k, j) - log.qref(k, j); }, always);
  nlohmann::ordered_json json{{"log", o.out},
                              {"first_tick", first_tick},
                              {"decimation", decimation},
                              {"samples", log.samples()},
                              {"tracking_rms_rad", List(tracking)}};
  report::Table table{{"joint", "tracking error rms / mrad", "moving / %"}, {}};
  const auto v_min = [&](int j) { return robot.joint[j].v_min_radps; };
  VectorXd residual;
  if (sample_reader) {
    io::WriteLog(o.samples, SampleLog(samples, robot, {player.first_tick, player.last_tick}, true));
    const io::Log played = SampleLog(samples, robot, {player.first_tick, player.last_tick}, false);
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
    table.rows.push_back({std::to_string(j + 1), fmt::format("{:.3f}", 1e3 * tracking[j]),
                          fmt::format("{:.0f}", 100.0 * moving / static_cast<double>(log.samples()))});
    if (sample_reader) table.rows.back().push_back(fmt::format("{:.3f}", residual[j]));
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
                         "play a trajectory on the (simulated) drive and record its trace\nexample: armcal record "
                         "--connect 127.0.0.1:1502 --robot er20_like --trajectory train.csv --out train_log.csv.gz");
  auto o = std::make_shared<RecordOptions>();
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  verb->add_option("--trajectory", o->trajectory, "trajectory of armcal excite")->required();
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

}  // namespace armcal::cli
