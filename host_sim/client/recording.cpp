// client - arms the traces, lets the drive play or work, takes the pages, and unpacks their records into logs.
#include "host_sim/client/recording.hpp"

#include <fmt/core.h>
#include <Eigen/LU>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <thread>

#include "armcal/controller/trace_records.hpp"
#include "armcal/link/registers.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/line_load.hpp"
#include "host_sim/client/packed_records.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/vendor_registers.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/data/trajectory/trajectory.hpp"

namespace armcal::client {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

namespace reg = link::reg;

struct Player {
  PlayerState state;
  StopReason reason;
  std::uint32_t points, first_tick, last_tick;
  bool moving() const { return state == PlayerState::kBlending || state == PlayerState::kPlaying; }
};

Player ReadPlayer(DriveClient& drive) {
  const auto w = drive.ReadInput(kPlayerStatus, kPlayerStatusCount);
  return {static_cast<PlayerState>(w[0]), static_cast<StopReason>(w[1]), core::GetU32(&w[2]), core::GetU32(&w[4]),
          core::GetU32(&w[6])};
}

bool IsInterrupted(const RecordOptions& o) { return o.interrupted != nullptr && *o.interrupted; }

void ThrowIfInterrupted(const RecordOptions& o) {
  if (IsInterrupted(o)) throw InterruptedError("interrupted");
}

[[noreturn]] void KeepNothing(const RecordOptions& o, const std::string& why) {
  if (IsInterrupted(o)) throw InterruptedError(why);
  throw LinkError(why);
}

void Upload(DriveClient& drive, const RecordOptions& o, const trajectory::Trajectory& t) {
  const int n = t.joints(), points = static_cast<int>(t.q.rows()), chunk = (kPlayerPointsCount - 2) / (2 * n);
  std::uint16_t setup[4];
  core::PutU32(setup, points);
  core::PutU32(setup + 2, static_cast<std::uint32_t>(std::lround(t.step_s * 1e6)));
  drive.Write(kPlayerSetup, setup);
  report::Progress progress("load trajectory");
  std::vector<std::uint16_t> w;
  for (int first = 0; first < points; first += chunk) {
    ThrowIfInterrupted(o);
    const int count = std::min(chunk, points - first);
    w.assign(2 + 2 * n * count, 0);
    core::PutU32(w.data(), first);
    for (int k = 0; k < count * n; ++k) core::PutF32(&w[2 + 2 * k], static_cast<float>(t.q(first + k / n, k % n)));
    drive.Write(kPlayerPoints, w);
    progress.Set(static_cast<double>(first + count) / points);
  }
}

// Waits (the drive's own time decides, not ours) until `done` says so; ten seconds without it is a broken drive.
template <class Done>
void WaitFor(DriveClient& drive, const char* what, Done done) {
  for (int k = 0; k < 2000; ++k) {
    if (done()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  throw LinkError(drive.name() + ": nothing for ten seconds; expected: " + what);
}

std::string Describe(const Player& p) {
  switch (p.reason) {
    case StopReason::kTrackingError:
      return "tracking error";
    case StopReason::kNoTrajectory:
      return "no trajectory";
    case StopReason::kCommand:
      return "stop command";
    case StopReason::kNone:
      break;
  }
  return "no reason given";
}

// Traces 0 and, if asked for, 1, from the next sample's tick on until Stop.
class Traces {
 public:
  Traces(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot, Recording& recording)
      : drive_(drive) {
    const Identity id = drive.ReadIdentity();
    if (drive.line()) load_ = MeasureLine(drive, id.map_minor >= 4);
    TraceRequest request;
    recording.packed = o.lean && drive.line() && (id.capabilities & reg::kHasPacked) != 0;
    request.channels = recording.packed ? controller::kRawPacked
                       : o.lean         ? controller::kRawMotion | controller::kRawFlags
                                        : controller::kRawAll;
    recording.wanted_decimation = o.decimation > 0 ? o.decimation : robot.sample_ticks;
    const int n = robot.joints(), words = recording.packed ? 2 * n + (n + 1) / 2 + 1 : o.lean ? 5 * n : 11 * n;
    recording.decimation =
        drive.line() ? Fitting(o, robot, words, recording.wanted_decimation) : recording.wanted_decimation;
    request.decimation = static_cast<std::uint16_t>(recording.decimation);
    // windows of the trace and of the drive's own samples are the same ticks
    const auto sample_ticks = static_cast<std::uint32_t>(robot.sample_ticks);
    request.start_tick = (drive.ReadStatus().tick / sample_ticks + 2) * sample_ticks;
    const auto taking = [&](int record_words) {
      return load_ && load_->WindowPays(record_words) ? Taking::kWindow : Taking::kPages;
    };
    StartTrace(drive, 0, request);
    reader_.emplace(drive, 0, Gaps::kAllow, taking(words));
    if (o.samples.empty()) return;
    TraceRequest all;
    all.channels = controller::kSampleAll;
    StartTrace(drive, 1, all);
    sample_reader_.emplace(drive, 1, Gaps::kAllow, taking(n * controller::kSampleWordsPerJoint));
  }
  // How many records came; a moment's rest for the drive if none waited.
  std::size_t Take(Recording& to) {
    const std::size_t got = reader_->TakePage(to.raw) + (sample_reader_ ? sample_reader_->TakePage(to.samples) : 0);
    if (got == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return got;
  }
  void Stop() {
    TraceRequest off;
    off.mode = TraceMode::kOff;
    StartTrace(drive_, 0, off);
    if (sample_reader_) StartTrace(drive_, 1, off);
  }

 private:
  // The decimation that the line can carry; it says so if that is not the one that was wanted.
  int Fitting(const RecordOptions& o, const codegen::Robot& robot, int words, int wanted) {
    const int n = robot.joints();
    const LineLoad& line = *load_;
    const double sample_share = o.samples.empty() ? 0
                                                  : line.SecondsOf(n * controller::kSampleWordsPerJoint) *
                                                        robot.tick_rate_Hz / robot.sample_ticks;
    const int fits = line.Decimation(words, wanted, robot.sample_ticks, robot.tick_rate_Hz, sample_share);
    if (fits == 0)
      throw io::InputError(fmt::format(
          "{}: {} baud with a turnaround of {:.0f} ms carries no recording{}; take a faster line", drive_.name(),
          drive_.line()->baud, 1e3 * line.turnaround_s, o.samples.empty() ? "" : " with --samples"));
    if (fits != wanted)
      fmt::print(
          "{}: {} baud with a turnaround of {:.0f} ms cannot carry {:.0f} records of {} registers a second; "
          "{} ticks are averaged into one record instead of {}{}\n",
          drive_.name(), drive_.line()->baud, 1e3 * line.turnaround_s, robot.tick_rate_Hz / wanted, words, fits, wanted,
          o.lean ? "" : " (--lean needs less)");
    return fits;
  }

  DriveClient& drive_;
  std::optional<LineLoad> load_;  // of a serial line
  std::optional<TraceReader> reader_, sample_reader_;
};

// The part of a recording that is whole: the longest run of ticks without a gap.
void KeepLongestRun(TraceRecords& r) {
  std::size_t best = 0, best_count = 0;
  for (std::size_t first = 0, k = 1; k <= r.count(); ++k)
    if (k == r.count() || r.ticks[k] - r.ticks[k - 1] != r.tick_step) {
      if (k - first > best_count) best = first, best_count = k - first;
      first = k;
    }
  const auto cut = [&](auto& list, std::size_t each) {
    list.erase(list.begin() + static_cast<std::ptrdiff_t>((best + best_count) * each), list.end());
    list.erase(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(best * each));
  };
  cut(r.ticks, 1), cut(r.generations, 1), cut(r.words, r.record_words);
}

// A window of `ticks` ticks from `first` on lies whole in the played part; ticks wrap.
bool Inside(std::uint32_t first, std::uint32_t ticks, const PlayedTicks& played) {
  return first - played.first < 0x80000000u && played.last - (first + ticks - 1) < 0x80000000u;
}

// Stops and disables the arm of a drive that plays, on each way out.
class ArmGuard {
 public:
  ArmGuard(DriveClient& drive, std::optional<Traces>& traces) : drive_(drive), traces_(traces) {}
  ~ArmGuard() {
    if (!released_) (void)TryRelease();
  }
  ArmGuard(const ArmGuard&) = delete;
  ArmGuard& operator=(const ArmGuard&) = delete;

  void Command(PlayerCommand command) { drive_.WriteSingle(kPlayerCommand, static_cast<std::uint16_t>(command)); }
  void Enable() {
    enabled_ = true;
    Command(PlayerCommand::kEnable);
  }
  void Release() {
    released_ = true;
    Command(PlayerCommand::kStop);
    Command(PlayerCommand::kDisable);
    try {  // a drive in virtual time waits for whoever reads a trace
      if (traces_) traces_->Stop();
    } catch (const RefusedError&) {  // another client has taken it
    }
    WaitFor(drive_, "axes disabled", [&] { return ReadPlayer(drive_).state == PlayerState::kDisabled; });
  }
  // False: the drive did not answer, or it refused.
  bool TryRelease() {
    try {
      Release();
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  // It was told so at least.
  bool enabled() const { return enabled_; }

 private:
  DriveClient& drive_;
  std::optional<Traces>& traces_;
  bool enabled_ = false, released_ = false;
};

// Takes records until the motion has ended and no more come. `player` is what the drive said last.
void TakeMotion(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot, double duration_s,
                Traces& traces, Recording& recording, Player& player) {
  report::Progress progress("record");
  // A drive in virtual time stands still soon after the motion, and then there are no more records. The tick of a
  // real drive goes on: what comes half a second later belongs to no motion.
  int quiet = 0;  // looks in a row that found nothing after the motion
  const auto rest_ticks = static_cast<std::int32_t>(0.5 * robot.tick_rate_Hz);
  const auto over = [&](const TraceRecords& r) {
    return !r.ticks.empty() && static_cast<std::int32_t>(r.ticks.back() - player.last_tick) > rest_ticks;
  };
  for (bool moved = false, done = false; !done;) {
    ThrowIfInterrupted(o);
    const std::size_t got = traces.Take(recording);
    player = ReadPlayer(drive);
    moved = moved || player.moving() || player.state == PlayerState::kFinished || player.state == PlayerState::kStopped;
    if (player.state == PlayerState::kPlaying && !recording.raw.ticks.empty())
      progress.Set(
          std::max(0.0, static_cast<double>(static_cast<std::int32_t>(recording.raw.ticks.back() - player.first_tick)) /
                            robot.tick_rate_Hz / duration_s * o.speed_percent / 100));
    const bool ended = moved && !player.moving();
    quiet = ended && got == 0 ? quiet + 1 : 0;
    const bool all_came = over(recording.raw) && (o.samples.empty() || over(recording.samples));
    done = ended && (quiet == 10 || all_came || player.state == PlayerState::kStopped);
  }
}

// The drive plays the trajectory.
Recording Play(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot) {
  const trajectory::Trajectory trajectory = trajectory::ReadTrajectory(o.trajectory, robot.joints());
  Recording recording;
  Player player{};
  std::optional<Traces> traces;
  ArmGuard arm(drive, traces);
  try {
    Upload(drive, o, trajectory);
    drive.WriteSingle(kPlayerSpeed, static_cast<std::uint16_t>(o.speed_percent));
    traces.emplace(drive, o, robot, recording);
    arm.Enable();
    WaitFor(drive, "axes enabled", [&] {
      ThrowIfInterrupted(o);
      traces->Take(recording);
      return ReadPlayer(drive).state != PlayerState::kDisabled;
    });
    arm.Command(PlayerCommand::kStart);
    TakeMotion(drive, o, robot, trajectory.duration_s(), *traces, recording, player);
    arm.Release();
  } catch (const LinkError& error) {
    std::string why = error.what();
    if (!arm.TryRelease() && arm.enabled()) why += "; the arm may still be moving and enabled";
    const bool finished = player.state == PlayerState::kFinished;
    if ((player.state != PlayerState::kPlaying && !finished) || recording.raw.ticks.empty()) KeepNothing(o, why);
    recording.cut = why;
    recording.played = {player.first_tick,
                        finished ? player.last_tick : recording.raw.ticks.back() + recording.raw.tick_step - 1};
    return recording;
  }
  if (player.state == PlayerState::kStopped)
    throw RefusedError(drive.name() + ": the motion was stopped: " + Describe(player), 0, core::Status::kHeld);
  recording.played = {player.first_tick, player.last_tick};
  return recording;
}

// The drive goes on with its work.
Recording Watch(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot) {
  using Clock = std::chrono::steady_clock;
  Recording recording;
  Traces traces(drive, o, robot, recording);
  TraceRecords& raw = recording.raw;
  report::Progress progress("record");
  Clock::time_point last = Clock::now();
  try {
    for (double seconds = 0; raw.ticks.empty() || seconds < o.seconds;) {
      ThrowIfInterrupted(o);
      if (traces.Take(recording) > 0) last = Clock::now();
      if (Clock::now() - last > std::chrono::seconds(10))
        throw LinkError(
            drive.name() +
            ": no record for ten seconds; does its control loop run? armcal watch shows whether the tick rises");
      if (raw.ticks.empty()) continue;
      seconds = (raw.ticks.back() - raw.ticks.front()) / robot.tick_rate_Hz;
      progress.Set(std::min(1.0, seconds / o.seconds));
    }
    traces.Stop();
  } catch (const LinkError& error) {
    if (raw.ticks.empty()) throw;
    recording.cut = error.what();
  }
  recording.played = {raw.ticks.front(), raw.ticks.back() + raw.tick_step - 1};
  return recording;
}

// Returns the drive's schema. Throws io::InputError, RefusedError.
std::uint32_t CheckDrive(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot) {
  const Identity id = drive.ReadIdentity();
  const auto same = [&](const char* what, double of_drive, double of_robot) {
    if (std::abs(of_drive - of_robot) >= 1)
      throw io::InputError(
          fmt::format("{}: {:g} {}, robot {} has {:g}; give the robot file that the drive was built for", drive.name(),
                      of_drive, what, robot.name, of_robot));
  };
  same("axes", id.axes, robot.joints());
  same("ticks a second", id.tick_rate_Hz, robot.tick_rate_Hz);
  same("ticks a sample", id.sample_ticks, robot.sample_ticks);
  const auto need = [&](std::uint32_t capability, const char* what) {
    if ((id.capabilities & capability) == 0)
      throw RefusedError(fmt::format("{}: serves no {}", drive.name(), what), 0, core::Status::kBadAddress);
  };
  need(reg::kHasRawTrace, "raw trace (Controller::Record)");
  if (!o.samples.empty()) need(reg::kHasSampleTrace, "trace of processed samples, for --samples");
  try {
    if (!o.trajectory.empty()) (void)ReadPlayer(drive);
  } catch (const RefusedError&) {
    throw RefusedError(drive.name() +
                           ": plays no trajectories; move the arm by its own controller, with --seconds "
                           "instead of --trajectory",
                       0, core::Status::kBadAddress);
  }
  if (id.schema != o.schema)  // the drive's model may only have other effects, which change no log
    fmt::print(
        stderr,
        "armcal: {}: the drive runs schema {}, robot {} has {}; if this is the robot file of another arm, the log "
        "is wrong\n",
        drive.name(), CrcText(id.schema), robot.name, CrcText(o.schema));
  return id.schema;
}

}  // namespace

Recording Record(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot) {
  const std::uint32_t schema = CheckDrive(drive, o, robot);
  Recording recording = o.trajectory.empty() ? Watch(drive, o, robot) : Play(drive, o, robot);
  recording.schema = schema;
  recording.failed_attempts = drive.failed_attempts();
  if (const std::uint32_t lost = recording.raw.lost + recording.samples.lost; lost > 0 && recording.cut.empty())
    recording.cut = fmt::format(
        "{}: {} trace records were lost: the link or this computer was too slow; --lean and --decimation ask for less",
        drive.name(), lost);
  if (!recording.cut.empty()) {  // nothing is glued over a gap
    KeepLongestRun(recording.raw), KeepLongestRun(recording.samples);
    const auto played = std::count_if(recording.raw.ticks.begin(), recording.raw.ticks.end(), [&](std::uint32_t tick) {
      return Inside(tick, recording.raw.tick_step, recording.played);
    });
    if (played < logs::kMinSamples) KeepNothing(o, recording.cut + "; nothing is kept");
  }
  if (recording.packed) {
    Unpacked plain = Unpack(recording.raw, robot.joints());
    recording.raw = std::move(plain.records);
    recording.unknown = plain.unknown;
  }
  return recording;
}

namespace {

// Joint quantities from averaged motor counts and current, by the robot file's nominal constants.
struct AxisScale {
  MatrixXd to_joint, torque_to_joint;
  VectorXd counts_to_rad, lsb_to_Nm, zero;
  explicit AxisScale(const codegen::Robot& r) : counts_to_rad(r.joints()), lsb_to_Nm(r.joints()), zero(r.joints()) {
    const int n = r.joints();
    MatrixXd C = MatrixXd::Identity(n, n);
    for (std::size_t k = 0; k < r.coupling.size(); ++k)
      C(static_cast<int>(k) / n, static_cast<int>(k) % n) = r.coupling[k];
    to_joint = C.inverse();
    torque_to_joint = C.transpose();
    for (int j = 0; j < n; ++j) {
      const auto& m = r.joint[j].motor;
      counts_to_rad[j] = 2 * std::numbers::pi / (m.counts_per_turn * m.gear_ratio);
      lsb_to_Nm[j] = m.current_A_per_lsb * m.torque_constant_NmpA * m.gear_ratio;
      zero[j] = m.zero_counts;
    }
  }
};

}  // namespace

logs::Log RawLog(const TraceRecords& r, const codegen::Robot& robot, const PlayedTicks& played,
                 std::uint32_t& first_tick) {
  const int n = robot.joints();
  const AxisScale scale(robot);
  std::vector<std::size_t> inside;
  for (std::size_t k = 0; k < r.count(); ++k)
    if (Inside(r.ticks[k], r.tick_step, played)) inside.push_back(k);
  if (inside.size() < logs::kMinSamples)
    throw LinkError("trace: " + std::to_string(inside.size()) + " records of the trajectory, expected at least " +
                    std::to_string(logs::kMinSamples));
  first_tick = r.ticks[inside[0]];
  logs::Log log;
  const auto N = static_cast<Eigen::Index>(inside.size());
  log.joints = n;
  log.source = "trace";
  log.t.resize(N);
  const bool warm = r.channels & controller::kRawTemperature, told = r.channels & controller::kRawSetPoint;
  for (MatrixXd* m : {&log.q, &log.tau}) m->resize(N, n);
  if (warm) log.temp.resize(N, n);
  if (told) log.qref.resize(N, n), log.tauff.resize(N, n);
  log.flags.resize(N, n);
  VectorXd motor(n), current(n);
  // Sixteenths of a count wrap at 2^32. The first one is taken as within 2^27 counts of the joint's zero, and from
  // there on no two records are 2^27 counts apart.
  std::vector<std::uint32_t> before(static_cast<std::size_t>(n));
  std::vector<std::int64_t> sixteenths(static_cast<std::size_t>(n), 0);
  for (Eigen::Index i = 0; i < N; ++i) {
    const std::uint16_t* w = &r.words[inside[i] * r.record_words];
    log.t[i] = static_cast<double>(r.ticks[inside[i]] - first_tick) / robot.tick_rate_Hz;
    for (int j = 0; j < n; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const std::uint32_t now = core::GetU32(w), zero = 16 * static_cast<std::uint32_t>(std::llround(scale.zero[j]));
      sixteenths[at] += static_cast<std::int32_t>(now - (i == 0 ? zero : before[at]));
      before[at] = now;
      motor[j] = scale.counts_to_rad[j] * static_cast<double>(sixteenths[at]) / 16;
      current[j] = scale.lsb_to_Nm[j] * static_cast<std::int32_t>(core::GetU32(w + 2)) / 16.0;
      w += 4;
      if (warm) log.temp(i, j) = core::GetF32(w), w += 2;
      log.flags(i, j) = *w++;
      if (told) log.qref(i, j) = core::GetF32(w), log.tauff(i, j) = core::GetF32(w + 2), w += 4;
    }
    log.q.row(i) = scale.to_joint * motor;
    log.tau.row(i) = scale.torque_to_joint * current;
  }
  return log;
}

logs::Log SampleLog(const TraceRecords& r, const codegen::Robot& robot, const PlayedTicks& played, bool all) {
  const int n = robot.joints();
  logs::Log log;
  log.joints = n;
  std::vector<std::size_t> inside;
  for (std::size_t k = 0; k < r.count(); ++k)
    if (all || Inside(r.ticks[k], robot.sample_ticks, played)) inside.push_back(k);
  const auto N = static_cast<Eigen::Index>(inside.size());
  log.t.resize(N);
  for (MatrixXd* m : {&log.q, &log.qd, &log.qdd, &log.tau, &log.temp, &log.tauff}) m->resize(N, n);
  log.flags.resize(N, n);
  for (Eigen::Index i = 0; i < N; ++i) {
    const std::uint32_t since = r.ticks[inside[i]] - r.ticks[inside[0]];  // ticks wrap
    log.t[i] = (static_cast<double>(r.ticks[inside[0]]) + since) / robot.tick_rate_Hz;
    const std::uint16_t* w = &r.words[inside[i] * r.record_words];
    for (int j = 0; j < n; ++j, w += controller::kSampleWordsPerJoint) {
      log.q(i, j) = core::GetF32(w), log.qd(i, j) = core::GetF32(w + 2), log.qdd(i, j) = core::GetF32(w + 4);
      log.tau(i, j) = core::GetF32(w + 6), log.temp(i, j) = core::GetF32(w + 8);
      log.flags(i, j) = w[10];
      log.tauff(i, j) = core::GetF32(w + 11);
    }
  }
  return log;
}

}  // namespace armcal::client
