// calibration - checks a log against the robot's limits, then against the torque that the robot file's bodies need.
#include "host_sim/identify/calibration/log_check.hpp"
#include <fmt/core.h>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"

namespace armcal::calibration {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kShortest_s = 3;      // a second is lost at the ends, and two are needed to fit and judge
constexpr double kMissingShare = 0.1;  // of the samples
constexpr double kOutside = 0.5;   // of a joint's range: how far a position may lie beyond it, since limits may be soft
constexpr double kOverTorque = 3;  // times the limit; smaller peaks above the rated torque are normal
constexpr double kJumpSpeed = 3;   // times the speed limit between two samples
constexpr double kStopAcceleration = 20;  // times the acceleration limit: no motor stops a joint that fast
constexpr double kHeld_s = 0.1, kSilent_s = 0.5;
constexpr double kDegPerRad = 57.29577951308232;

[[noreturn]] void Fail(const logs::Log& log, const std::string& what) {
  throw io::InputError(log.source + ": " + what);
}

std::string Joint(int j) { return fmt::format("joint {}: ", j + 1); }

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
                     k + 3, log.t[k + 1] - log.t[k]));
  }
}

std::vector<std::string> CheckGaps(const logs::Log& log) {
  if (log.gaps.empty()) return {};
  double missing = 0;
  for (const int k : log.gaps) missing += std::round((log.t[k + 1] - log.t[k]) / log.step_s()) - 1;
  const std::string text = fmt::format("{:.0f} samples are missing in {} gaps", missing, log.gaps.size());
  if (missing > kMissingShare * (missing + static_cast<double>(log.samples())))
    Fail(log, text + fmt::format(" ({:.0f} %), expected less than {:.0f} %",
                                 100 * missing / (missing + static_cast<double>(log.samples())), 100 * kMissingShare));
  return {log.source + ": " + text + "; samples beside them are not used"};
}

void CheckPosition(const codegen::Robot& robot, const logs::Log& log, int j) {
  const codegen::Joint& joint = robot.joint[j];
  const auto [lower, upper] = joint.position_limit_rad;
  const double room = kOutside * (upper - lower), low = log.q.col(j).minCoeff(), high = log.q.col(j).maxCoeff();
  const bool angle = joint.kinematics.type == codegen::JointType::kRevolute;
  if (low < lower - room || high > upper + room) {
    const bool degrees = angle && low / kDegPerRad > lower - room && high / kDegPerRad < upper + room;
    Fail(log, Joint(j) + fmt::format("position {:.4g} .. {:.4g}{}, expected within {:.3g} .. {:.3g} {}", low, high,
                                     degrees ? " looks like degrees" : "", lower, upper, angle ? "rad" : "m"));
  }
  if (low == high) Fail(log, Joint(j) + "position never changes, expected motion (is the encoder stuck?)");
  const double step_s = log.step_s();
  int held = 0;  // samples for which it has stayed the same
  for (Index k = 1; k < log.samples(); ++k) {
    const double dt = log.t[k] - log.t[k - 1], step = log.q(k, j) - log.q(k - 1, j);
    if (dt > 1.5 * step_s) {
      held = 0;
      continue;
    }
    const bool stuck = held * dt > kHeld_s;
    if (std::abs(step) > kJumpSpeed * joint.speed_limit_radps * dt)
      Fail(log, Joint(j) + fmt::format("line {}: position {} by {:.3g} in one sample, expected at most {:.3g}", k + 2,
                                       stuck ? "is stuck, then jumps" : "jumps", step, joint.speed_limit_radps * dt));
    const bool leaps = std::abs(step) > kStopAcceleration * joint.acceleration_limit_radps2 * dt * dt;
    if (stuck && step != 0 && leaps)
      Fail(log,
           Joint(j) + fmt::format("line {}: position is stuck for {:.2g} s, then moves at once", k + 2, held * dt));
    held = step == 0 ? held + 1 : 0;
    if (held * dt <= kHeld_s || (held - 1) * dt > kHeld_s || k - held < 3) continue;
    const Index start = k - held;  // the last sample before it froze; the speed into it
    const double speed = (log.q(start, j) - log.q(start - 3, j)) / (log.t[start] - log.t[start - 3]);
    if (std::abs(speed) > kStopAcceleration * joint.acceleration_limit_radps2 * dt)
      Fail(log, Joint(j) + fmt::format("line {}: position freezes at a speed of {:.2g} (is the encoder stuck?)",
                                       start + 2, speed));
  }
}

void CheckTorque(const codegen::Robot& robot, const logs::Log& log, int j) {
  const codegen::Joint& joint = robot.joint[j];
  const double largest = log.tau.col(j).cwiseAbs().maxCoeff();
  if (log.tau.col(j).minCoeff() == log.tau.col(j).maxCoeff())
    Fail(log, Joint(j) + (largest == 0 ? "torque is zero throughout, expected a measured torque"
                                       : "torque never changes, expected a measured torque"));
  // The median is no peak: a limit may be passed now and then, not most of the time.
  VectorXd size = log.tau.col(j).cwiseAbs();
  std::nth_element(size.begin(), size.begin() + size.size() / 2, size.end());
  const double median = size[size.size() / 2];
  if (median > kOverTorque * joint.torque_limit_Nm)
    Fail(log, Joint(j) + fmt::format("torque {:.4g} most of the time{}, expected at most {:.4g} N m", median,
                                     largest / 1000 <= kOverTorque * joint.torque_limit_Nm ? " looks like mN m" : "",
                                     joint.torque_limit_Nm));
  int silent = 0;
  for (Index k = 1; k < log.samples(); ++k) {
    const double dt = log.t[k] - log.t[k - 1];
    const bool moving = std::abs(log.q(k, j) - log.q(k - 1, j)) > joint.v_min_radps * dt;
    silent = moving && log.tau(k, j) == log.tau(k - 1, j) ? silent + 1 : 0;
    if (silent * dt <= kSilent_s) continue;
    Fail(log,
         Joint(j) + fmt::format("line {}: torque stays at {:.3g} while the joint moves, expected a measured torque",
                                k + 2, log.tau(k, j)));
  }
}

}  // namespace

std::vector<std::string> CheckSignals(const codegen::Robot& robot, const logs::Log& log) {
  const double seconds = log.t[log.samples() - 1] - log.t[0];
  if (seconds < kShortest_s)
    Fail(log, fmt::format("{:.2g} s of log, expected at least {:.0f} s", seconds, kShortest_s));
  for (int j = 0; j < log.joints; ++j) CheckTorque(robot, log, j);
  CheckClock(log);
  std::vector<std::string> notes = CheckGaps(log);
  for (int j = 0; j < log.joints; ++j) CheckPosition(robot, log, j);
  return notes;
}

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRows = 600;        // of a log: enough to tell columns apart
constexpr double kExchanged = 2;  // by how much an exchange of two columns must cut the sum of log residual variances
constexpr double kScale = 20;     // a torque this much larger or smaller than the bodies need is in another unit
constexpr double kTelling =
    0.5;  // share of the torque without friction that the bodies must explain before its scale is judged
constexpr double kTiny = 0.01;  // of the torque limit: a cable may need as much

struct Match {
  double log_left = 0;  // log of the share of variance left
  double told = 0;      // share of what friction leaves that the bodies explain
  double scale = 1;     // measured over needed
  double needed = 0;    // RMS about its mean
};

// torque = scale needed + Coulomb, viscous, offset, over rows of one joint.
Match Compare(const VectorXd& torque, const VectorXd& needed, const VectorXd& speed) {
  MatrixXd A(torque.size(), 4);
  A << needed, speed.cwiseSign(), speed, VectorXd::Ones(torque.size());
  const VectorXd x = A.colPivHouseholderQr().solve(torque);
  const double left = (torque - A * x).squaredNorm();
  const double all = (torque.array() - torque.mean()).square().sum();
  const MatrixXd friction = A.rightCols(3);
  const double without = (torque - friction * friction.colPivHouseholderQr().solve(torque)).squaredNorm();
  return {std::log(std::max(left, 1e-12 * all) / std::max(all, 1e-300)), 1 - left / std::max(without, 1e-300), x[0],
          std::sqrt((needed.array() - needed.mean()).square().mean())};
}

codegen::Signals EveryOf(const Dataset& d, MatrixXd& tau) {
  const int step = std::max(1, d.samples() / kRows);
  const auto rows = Eigen::seq(0, d.samples() - 1, step);
  tau = d.tau(rows, Eigen::all);
  codegen::Signals s;
  s.t = d.s.t(rows), s.q = d.s.q(rows, Eigen::all), s.qd = d.s.qd(rows, Eigen::all), s.qdd = d.s.qdd(rows, Eigen::all);
  return s;
}

class Checker {
 public:
  Checker(const codegen::Model& model, const Dataset& data) : model_(model), signals_(EveryOf(data, tau_)) {
    VectorXd bodies(model.body_parameters());
    for (int k = 0; k < bodies.size(); ++k) bodies[k] = model.table()[k].mean;
    base_ = model.base_map() * bodies;
  }

  std::vector<Match> Compare(const codegen::Signals& s, const MatrixXd& tau) const {
    std::vector<MatrixXd> row;
    model_.Regressor(s, {}, {}, row);
    std::vector<Match> out;
    for (int j = 0; j < model_.joints(); ++j)
      out.push_back(
          calibration::Compare(tau.col(j), row[j].middleCols(model_.front(), model_.rigid()) * base_, s.qd.col(j)));
    return out;
  }
  double Left(bool positions, bool torques, int i, int j) const {
    codegen::Signals s = signals_;
    MatrixXd tau = tau_;
    if (positions)
      for (MatrixXd* m : {&s.q, &s.qd, &s.qdd}) m->col(i).swap(m->col(j));
    if (torques) tau.col(i).swap(tau.col(j));
    double sum = 0;
    for (const Match& m : Compare(s, tau)) sum += m.log_left;
    return sum;
  }
  const codegen::Signals& signals() const { return signals_; }
  const MatrixXd& tau() const { return tau_; }

 private:
  const codegen::Model& model_;
  MatrixXd tau_;
  codegen::Signals signals_;
  VectorXd base_;
};

}  // namespace

void CheckAgainstModel(const codegen::Model& model, const Dataset& data) {
  if (!model.robot().has_prior) return;
  const Checker checker(model, data);
  const double as_given = checker.Left(false, false, 0, 0);
  double least = as_given - kExchanged;
  std::string exchanged;
  for (int i = 0; i < model.joints(); ++i)
    for (int j = i + 1; j < model.joints(); ++j)
      for (const auto& [positions, torques, name] : {std::tuple{true, false, "q"}, std::tuple{false, true, "tau"}}) {
        const double left = checker.Left(positions, torques, i, j);
        if (left < least) least = left, exchanged = fmt::format("{0}{1} and {0}{2}", name, i + 1, j + 1);
      }
  if (!exchanged.empty())
    throw io::InputError(data.source + ": columns " + exchanged +
                         " seem to be exchanged; expected each in its joint's place");
  const std::vector<Match> match = checker.Compare(checker.signals(), checker.tau());
  for (int j = 0; j < model.joints(); ++j) {
    const Match& m = match[static_cast<std::size_t>(j)];
    if (m.needed < kTiny * model.robot().joint[j].torque_limit_Nm || m.told < kTelling) continue;
    if (m.scale > 1 / kScale && m.scale < kScale) continue;
    throw io::InputError(
        data.source + fmt::format(": joint {}: torque is {:.2g} times what the robot file's bodies need, expected N m "
                                  "(N) on the joint side with the sign of q",
                                  j + 1, m.scale));
  }
}

}  // namespace armcal::calibration
