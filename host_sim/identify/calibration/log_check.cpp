// calibration - checks the samples of a log against the robot's limits and against each other.
#include "host_sim/identify/calibration/log_check.hpp"
#include <fmt/core.h>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/steps.hpp"

namespace armcal::calibration {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kShortest_s = 3;  // a second is lost at the ends, and two are needed to fit and judge
// Time in another unit. No arm passes its speed limit by this much in a tenth of its samples. No log of so low a rate
// shows an arm whose fastest joint crawls like this.
constexpr double kTooFast = 2, kTooSlow = 1.0 / 300, kSlowRate_Hz = 10;
constexpr double kMissingShare = 0.1;  // of the samples
constexpr double kOutside = 0.5;   // of a joint's range: how far a position may lie beyond it, since limits may be soft
constexpr double kOverTorque = 3;  // times the limit; smaller peaks above the rated torque are normal
constexpr double kJumpSpeed = 3;   // times the speed limit between two samples
constexpr double kStopAcceleration = 20;  // times the acceleration limit: no motor stops a joint that fast
constexpr double kHeld_s = 0.1, kSilent_s = 0.5;

[[noreturn]] void Fail(const logs::Log& log, const std::string& what) {
  throw io::InputError(log.source + ": " + what);
}

std::string Joint(int j) { return fmt::format("joint {}: ", j + 1); }

const char* PositionUnit(const codegen::Joint& joint) { return Slides(joint) ? "m" : "rad"; }

// At a true gap in time the joints move on by as many samples as are missing. If they move on by one sample only, the
// clock jumped.
void CheckClock(const logs::Log& log) {
  const double step = log.step_s();
  for (const int k : log.gaps) {
    const double steps = (log.t[k + 1] - log.t[k]) / step;
    if (steps < 3 || k < 5 || k + 6 >= log.samples()) continue;
    const VectorXd before = (log.q.row(k) - log.q.row(k - 5)) / 5, after = (log.q.row(k + 6) - log.q.row(k + 1)) / 5;
    const VectorXd speed = 0.5 * (before + after), moved = log.q.row(k + 1) - log.q.row(k);
    const double bend = (after - before).norm();
    if (speed.norm() < 1e-6 || bend > 0.5 * speed.norm()) continue;  // too slow or turning: the motion does not tell
    const double passed = moved.dot(speed) / speed.squaredNorm();
    if (passed > 0.5 * (1 + std::min(steps, 5.0))) continue;
    Fail(log,
         fmt::format("line {}: time jumps by {:.3g} s while the joints move on by one sample; expected the clock of "
                     "one run",
                     log.line_of(k + 1), log.t[k + 1] - log.t[k]));
  }
}

std::vector<std::string> CheckGaps(const logs::Log& log) {
  if (log.gaps.empty()) return {};
  // Rows that reading has left out are not missing. A value may stand in several lines.
  std::vector<double> lines;
  for (int k = 0; k + 1 < log.samples(); ++k) lines.push_back(log.line_of(k + 1) - log.line_of(k));
  const double lines_a_value = std::max(1.0, logs::Median(std::move(lines)));
  double missing = 0;
  for (const int k : log.gaps) {
    const double steps = std::round((log.t[k + 1] - log.t[k]) / log.step_s());
    const double values = std::round((log.line_of(k + 1) - log.line_of(k)) / lines_a_value);
    missing += std::max(0.0, steps - values);
  }
  if (missing == 0) return {};
  const std::string text = missing == 1 ? "1 sample is missing"
                                        : fmt::format("{:.0f} samples are missing, gaps: {}", missing, log.gaps.size());
  if (missing > kMissingShare * (missing + static_cast<double>(log.samples())))
    Fail(log, text + fmt::format(" ({:.0f} %), expected less than {:.0f} %",
                                 100 * missing / (missing + static_cast<double>(log.samples())), 100 * kMissingShare));
  return {text + "; samples beside them are not used"};
}

// Within reach, and not at rest while another column says that the joint moves.
void CheckRange(const codegen::Robot& robot, const logs::Log& log, int j) {
  const codegen::Joint& joint = robot.joint[j];
  const auto [lower, upper] = joint.position_limit_rad;
  const double room = kOutside * (upper - lower), low = log.q.col(j).minCoeff(), high = log.q.col(j).maxCoeff();
  if (low < lower - room || high > upper + room) {
    const bool degrees = !Slides(joint) && low / kDegPerRad > lower - room && high / kDegPerRad < upper + room;
    const bool millimetres = Slides(joint) && low / 1000 > lower - room && high / 1000 < upper + room;
    Fail(log, Joint(j) + fmt::format("position {:.4g} .. {:.4g}{}, expected within {:.3g} .. {:.3g} {}", low, high,
                                     degrees       ? " looks like degrees"
                                     : millimetres ? " looks like mm"
                                                   : "",
                                     lower, upper, PositionUnit(joint)));
  }
  if (low < high) return;
  const auto moves = [&](const Eigen::MatrixXd& block, double least) {
    return block.cols() == log.joints && block.col(j).maxCoeff() - block.col(j).minCoeff() > least;
  };
  const double v_min = joint.v_min_radps;
  if (moves(log.qd, 2 * v_min) || moves(log.qref, 100 * v_min * log.step_s()))
    Fail(log, Joint(j) + fmt::format("position never changes while its {} does (is the encoder stuck?)",
                                     moves(log.qd, 2 * v_min) ? "logged speed" : "command"));
}

// Leaps between two samples, and stretches at which the encoder sticks.
void CheckPosition(const codegen::Robot& robot, const logs::Log& log, int j) {
  const codegen::Joint& joint = robot.joint[j];
  const double step_s = log.step_s();
  int held = 0;  // samples for which it has stayed the same
  for (Index k = 1; k < log.samples(); ++k) {
    const double dt = log.t[k] - log.t[k - 1], step = log.q(k, j) - log.q(k - 1, j);
    if (dt > 1.5 * step_s) {
      held = 0;
      continue;
    }
    const bool stuck = held * dt > kHeld_s;
    const double farthest = kJumpSpeed * joint.speed_limit_radps * std::max(dt, step_s);  // a late stamp shortens dt
    if (std::abs(step) > farthest)
      Fail(log, Joint(j) + fmt::format("line {}: position {} by {:.3g} {} in one sample, expected at most {:.3g}",
                                       log.line_of(k), stuck ? "is stuck, then jumps" : "jumps", step,
                                       PositionUnit(joint), farthest / kJumpSpeed));
    const bool leaps = std::abs(step) > kStopAcceleration * joint.acceleration_limit_radps2 * dt * dt;
    if (stuck && step != 0 && leaps)
      Fail(log, Joint(j) + fmt::format("line {}: position is stuck for {:.2g} s, then moves at once", log.line_of(k),
                                       held * dt));
    held = step == 0 ? held + 1 : 0;
    if (held * dt <= kHeld_s || (held - 1) * dt > kHeld_s || k - held < 3) continue;
    const Index start = k - held;  // the last sample before it froze; the speed into it
    const double speed = (log.q(start, j) - log.q(start - 3, j)) / (log.t[start] - log.t[start - 3]);
    if (std::abs(speed) > kStopAcceleration * joint.acceleration_limit_radps2 * dt)
      Fail(log, Joint(j) + fmt::format("line {}: position freezes at a speed of {:.2g} {}/s (is the encoder stuck?)",
                                       log.line_of(start), speed, PositionUnit(joint)));
  }
}

double Quantile(VectorXd x, double share) {
  const Index at = std::min(x.size() - 1, static_cast<Index>(share * static_cast<double>(x.size())));
  std::nth_element(x.begin(), x.begin() + at, x.end());
  return x[at];
}

VectorXd Speeds(const logs::Log& log, int j) {
  const Index last = log.samples() - 1;
  return (log.q.col(j).tail(last) - log.q.col(j).head(last)).cwiseQuotient(log.t.tail(last) - log.t.head(last));
}

// Speeds that no clock in seconds shows.
void CheckPace(const codegen::Robot& robot, const logs::Log& log) {
  double fastest = 0;  // of all joints, as a share of its limit
  for (int j = 0; j < log.joints; ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const VectorXd speed = Speeds(log, j).cwiseAbs();
    fastest = std::max(fastest, speed.maxCoeff() / joint.speed_limit_radps);
    const double usual = Quantile(speed, 0.9);
    if (usual > kTooFast * joint.speed_limit_radps)
      Fail(log,
           Joint(j) + fmt::format("moves faster than {:.3g} {}/s for a tenth of the time, expected at most {:.3g}; is "
                                  "time (step {:.3g} s) in another unit than s?",
                                  usual, PositionUnit(joint), joint.speed_limit_radps, log.step_s()));
  }
  if (fastest == 0) Fail(log, "no joint moves, expected motion");
  if (fastest < kTooSlow && log.step_s() * kSlowRate_Hz > 1)
    Fail(log,
         fmt::format("time step {:.3g} s, and no joint is faster than 1/{:.0f} of its limit; expected time in s, it "
                     "looks like ms ({:.4g} Hz)",
                     log.step_s(), 1 / fastest, 1000 / log.step_s()));
}

// A logged speed against the positions: slope of dq/dt over qd, and the share of dq/dt that it explains.
struct SpeedMatch {
  double slope = 0, told = 0;
};

SpeedMatch MatchSpeed(const logs::Log& log, int j) {
  const Index last = log.samples() - 1;
  const VectorXd dt = log.t.tail(last) - log.t.head(last), dq = log.q.col(j).tail(last) - log.q.col(j).head(last);
  const VectorXd way = 0.5 * (log.qd.col(j).tail(last) + log.qd.col(j).head(last)).cwiseProduct(dt);
  const double square = way.squaredNorm(), cross = way.dot(dq), all = dq.squaredNorm();
  if (square == 0 || all == 0) return {};
  return {cross / square, cross * cross / (square * all)};
}

// All joints agree on another time unit, or one joint's speed has another unit or sign.
std::vector<std::string> CheckSpeedColumns(const codegen::Robot& robot, const logs::Log& log) {
  constexpr double kTold = 0.7, kAlike = 0.2, kRadps_rpm = 0.10471975511965977, kOfRpm = 0.02;
  if (log.qd.cols() != log.joints) return {};
  const auto near = [](double x, double y) { return std::abs(x / y - 1) < kAlike; };
  std::vector<std::string> notes;
  std::vector<double> slope;
  for (int j = 0; j < log.joints; ++j) {
    const double derived = Quantile(Speeds(log, j).cwiseAbs(), 0.9), logged = Quantile(log.qd.col(j).cwiseAbs(), 0.9);
    if (std::max(derived, logged) < robot.joint[j].v_min_radps) continue;
    const SpeedMatch m = MatchSpeed(log, j);
    if (m.told < kTold) continue;
    slope.push_back(m.slope);
    if (near(m.slope, 1)) continue;
    const char* looks = near(m.slope, -1)               ? "; its sign looks wrong"
                        : near(m.slope * kDegPerRad, 1) ? "; it looks like deg/s"
                        : near(m.slope, kRadps_rpm)     ? "; it looks like rpm"
                                                        : "";
    notes.push_back(Joint(j) +
                    fmt::format("the logged speed is {:.3g} times that of the positions{}", 1 / m.slope, looks));
  }
  const auto all_near = [&](double y) {
    return !slope.empty() && std::all_of(slope.begin(), slope.end(), [&](double s) { return near(s, y); });
  };
  for (const double y : {kDegPerRad, 1 / kDegPerRad})
    if (all_near(y))
      Fail(log, fmt::format("the logged speeds are {:.3g} times those of the positions; expected q and qd both in rad "
                            "or both in deg (units of the channel map)",
                            1 / y));
  // Speeds in rpm are near a tenth, too.
  const bool in_rpm = all_near(kRadps_rpm) && std::abs(logs::Median(slope) / kRadps_rpm - 1) < kOfRpm;
  for (const double factor : {10.0, 100.0, 1e3, 1e6, 1e9})
    for (const double y : {factor, 1 / factor})
      if (all_near(y) && !in_rpm)
        Fail(log,
             fmt::format("the positions move {:g} times {} than the logged speeds say (time step {:.3g} s); expected "
                         "time in s",
                         factor, y > 1 ? "faster" : "more slowly", log.step_s()));
  return notes;
}

void CheckTorque(const codegen::Robot& robot, const logs::Log& log, int j) {
  const codegen::Joint& joint = robot.joint[j];
  const double largest = log.tau.col(j).cwiseAbs().maxCoeff();
  const bool moves = log.q.col(j).minCoeff() < log.q.col(j).maxCoeff();  // a brake may hold a joint that rests
  if (moves && log.tau.col(j).minCoeff() == log.tau.col(j).maxCoeff())
    Fail(log, Joint(j) + (largest == 0 ? "torque is zero throughout, expected a measured torque"
                                       : "torque never changes, expected a measured torque"));
  // The median is no peak: a limit may be passed now and then, not most of the time.
  const VectorXd size = log.tau.col(j).cwiseAbs();
  const double median = logs::Median({size.begin(), size.end()});
  if (median > kOverTorque * joint.torque_limit_Nm)
    Fail(log, Joint(j) + fmt::format("torque {:.4g} most of the time{}, expected at most {:.4g} {}", median,
                                     largest / 1000 > kOverTorque * joint.torque_limit_Nm ? ""
                                     : Slides(joint)                                      ? " looks like mN"
                                                                                          : " looks like mN m",
                                     joint.torque_limit_Nm, TorqueUnit(joint)));
  int silent = 0;
  for (Index k = 1; k < log.samples(); ++k) {
    const double dt = log.t[k] - log.t[k - 1];
    const bool moving = std::abs(log.q(k, j) - log.q(k - 1, j)) > joint.v_min_radps * dt;
    silent = moving && log.tau(k, j) == log.tau(k - 1, j) ? silent + 1 : 0;
    if (silent * dt <= kSilent_s) continue;
    Fail(log,
         Joint(j) + fmt::format("line {}: torque stays at {:.3g} {} while the joint moves, expected a measured torque",
                                log.line_of(k), log.tau(k, j), TorqueUnit(joint)));
  }
}

}  // namespace

SignalCheck CheckSignals(const codegen::Robot& robot, const logs::Log& log) {
  SignalCheck check;
  check.notes = log.notes;
  const double seconds = log.t[log.samples() - 1] - log.t[0];
  if (seconds < kShortest_s)
    check.lack = fmt::format("{:.2g} s of log, expected at least {:.0f} s", seconds, kShortest_s);
  for (int j = 0; j < log.joints; ++j) CheckRange(robot, log, j);
  const std::vector<std::string> speeds =
      CheckSpeedColumns(robot, log);  // they know the unit of time better than limits
  CheckPace(robot, log);
  for (int j = 0; j < log.joints; ++j) CheckTorque(robot, log, j);
  CheckClock(log);
  for (const auto& notes : {CheckGaps(log), speeds}) check.notes.insert(check.notes.end(), notes.begin(), notes.end());
  for (int j = 0; j < log.joints; ++j) {
    CheckPosition(robot, log, j);
    if (log.q.col(j).minCoeff() == log.q.col(j).maxCoeff()) check.resting.push_back(j);
  }
  return check;
}

std::vector<std::string> CheckRows(const codegen::Robot& robot, const std::vector<const Dataset*>& data) {
  constexpr double kMoves = 0.01;  // of the samples: a joint that moves less rests
  double all = 0;
  int samples = 0;
  std::string without;
  for (int j = 0; j < robot.joints(); ++j) {
    double rows = 0, moving = 0;
    samples = 0;
    for (const Dataset* log : data) {
      rows += log->averaged(j) ? static_cast<double>(log->average[static_cast<std::size_t>(j)].rows())
                               : log->used.col(j).sum();
      moving += log->moving.col(j).sum();
      samples += log->samples();
    }
    all += rows;
    if (rows == 0 && moving > kMoves * samples) without += fmt::format("{}{}", without.empty() ? "" : ", ", j + 1);
  }
  const std::string name = data.front()->source + (data.size() > 1 ? " and the others" : "");
  if (all == 0)
    throw io::InputError(
        fmt::format("{}: none of the {} samples can be used; expected a joint that moves faster than its v_min ({:.3g} "
                    "{}/s for joint 1) away from turns, gaps and the ends of the log",
                    name, samples, robot.joint[0].v_min_radps, PositionUnit(robot.joint[0])));
  if (without.empty()) return {};
  return {
      fmt::format("{}: joint {}: no usable row, although it moves: nothing is fitted to its torque", name, without)};
}

}  // namespace armcal::calibration
