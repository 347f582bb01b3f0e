// calibration - compares the fit of logs as given with fits of exchanged and turned columns, and looks at its friction.
#include "host_sim/identify/calibration/column_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/column_fit.hpp"
#include "host_sim/identify/calibration/log_check.hpp"

namespace armcal::calibration {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kScreenRows = 300, kFullRows = 1200, kRounds = 3, kTried = 3;
constexpr int kRowsPerColumn = 2;  // fewer rows fit anything
// A change must cut the sum of log variances by this much. Healthy measured logs stay below a half of it.
constexpr double kClearGain = 2;
// Two joints of a redundant arm exchanged, q and tau, may fit a little better than the truth: the bodies are free.
constexpr const char* kWholeJoints = "joints ";
constexpr double kWholeGain = 4;
constexpr double kWorse = 1.1;     // no torque may fit worse by more than this under a change that is right
constexpr double kForeign = 1;     // a log whose sum of log variances is this much above that of all is looked at alone
constexpr double kImpossible = 3;  // times the speed limit: no log is that fast
// The unit of angles: two joints at least must move by this much, and their sum of log variances must fall by that
// much. Of a log with one moving joint the wrong unit may fit better by 2.3.
constexpr double kTurnedBy = 0.1, kUnitGain = 3;
constexpr double kNothing = 0.95;  // of the spread left: the model explains nothing
constexpr double kWhite = 0.75;    // mean square of steps over twice the variance; noise has 1
constexpr double kOverNoise = 3;   // times the declared noise: a spread that is more than noise
constexpr double kSure = 9;        // standard deviations of independent rows; rows are not independent
constexpr double kFedShare = 0.1;  // of the torque's spread; less than that, but more than the fit leaves, is suspect
// A joint at rest: RMS of its torque that the pose does not explain, of the torque limit and of the torque's spread.
// Stiction of measured arms leaves 2 % of the limit; joints that move behind a stuck encoder leave 7 % and more.
constexpr double kRounding = 1e-9;  // rad (m): what the filter makes of a constant
constexpr double kResting = 0.04, kUnexplained = 0.7;

std::string Names(const std::vector<const Dataset*>& data) {
  std::string text = data[0]->source;
  if (data.size() == 2) text += " and " + data[1]->source;
  if (data.size() > 2) text += fmt::format(" and {} more", data.size() - 1);
  return text;
}

struct Named {
  ColumnChange change;
  std::string what;
};

void Exchange(std::vector<int>& columns, int i, int j) {
  std::swap(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
}

// One step away from `from`, those of one motion behind each other.
std::vector<Named> Neighbours(const ColumnChange& from, int n) {
  std::vector<Named> out;
  const auto add = [&](const std::string& what, const auto& make) {
    out.push_back({from, what});
    make(out.back().change);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j)
      add(fmt::format("columns tau{} and tau{} seem to be exchanged", i + 1, j + 1),
          [&](ColumnChange& c) { Exchange(c.tau, i, j); });
    add(fmt::format("tau{} seems to have the wrong sign", i + 1),
        [&](ColumnChange& c) { c.tau_sign[static_cast<std::size_t>(i)] *= -1; });
  }
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (int j = i + 1; j < n; ++j) {
      add(fmt::format("columns q{} and q{} seem to be exchanged", i + 1, j + 1),
          [&](ColumnChange& c) { Exchange(c.q, i, j); });
      add(fmt::format("{}{} and {} seem to be exchanged (q and tau)", kWholeJoints, i + 1, j + 1),
          [&](ColumnChange& c) { Exchange(c.q, i, j), Exchange(c.tau, i, j); });
    }
    add(fmt::format("q{} seems to have the wrong sign", i + 1), [&](ColumnChange& c) { c.q_scale[at] *= -1; });
    add(fmt::format("q{0} and tau{0} seem to have the wrong sign", i + 1),
        [&](ColumnChange& c) { c.q_scale[at] *= -1, c.tau_sign[at] *= -1; });
  }
  for (const double pace : {10.0, 100.0, 0.1, 0.01})
    add(fmt::format("time seems to be {:g} times too {}", pace > 1 ? pace : 1 / pace, pace > 1 ? "long" : "short"),
        [&](ColumnChange& c) { c.pace *= pace; });
  return out;
}

// log_left of each candidate; a motion is evaluated once for all candidates that share it.
std::vector<double> Scores(const ColumnFit& fit, const std::vector<Named>& candidates) {
  std::vector<double> out;
  std::optional<ColumnFit::Motion> motion;
  const ColumnChange* of = nullptr;
  for (const Named& c : candidates) {
    if (of == nullptr || !of->same_motion(c.change)) motion = fit.Move(c.change), of = &c.change;
    out.push_back(fit.Fit(*motion, c.change).log_left);
  }
  return out;
}

// The right columns suit every torque. Wrong ones may suit one by chance, at the cost of another.
bool NoneWorse(const ColumnFitResult& given, const ColumnFitResult& changed, const ColumnChange& change) {
  for (std::size_t j = 0; j < change.tau.size(); ++j)
    if (changed.left[static_cast<Index>(j)] > kWorse * given.left[change.tau[j]]) return false;
  return true;
}

}  // namespace

ColumnGain BestColumnChange(const codegen::Model& model, const std::vector<const Dataset*>& data) {
  const int n = model.joints();
  const ColumnFit screen(model, data, kScreenRows), full(model, data, kFullRows);
  if (full.rows() < kRowsPerColumn * model.columns()) return {};
  ColumnChange best(n);
  const ColumnFitResult given = full.Fit(full.Move(best), best);
  double least = given.log_left;
  bool none_worse = false;
  ColumnGain out;
  for (int round = 0; round < kRounds; ++round) {
    const double here = screen.Fit(screen.Move(best), best).log_left;
    const std::vector<Named> candidates = Neighbours(best, n);
    const std::vector<double> score = Scores(screen, candidates);
    std::vector<std::size_t> order(score.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return score[a] < score[b]; });
    const Named* winner = nullptr;
    double found = least;
    bool fair = false;  // under the winner no torque fits worse
    for (std::size_t k = 0; k < std::min<std::size_t>(kTried, order.size()) && score[order[k]] < here; ++k) {
      const Named& c = candidates[order[k]];
      const ColumnFitResult result = full.Fit(full.Move(c.change), c.change);
      const bool here_fair = NoneWorse(given, result, c.change);
      if (result.log_left >= least || (fair && !here_fair) || (fair == here_fair && result.log_left >= found)) continue;
      found = result.log_left, fair = here_fair, winner = &c;
    }
    if (winner == nullptr || (round > 0 && least - found < kClearGain)) break;
    out.what += (out.what.empty() ? "" : "; ") + winner->what;
    least = found, none_worse = fair;
    best = winner->change;
    if (given.log_left - least < kClearGain) break;
  }
  out.gain = none_worse ? given.log_left - least : 0;
  out.as_given = std::exp(0.5 * given.log_left / n), out.changed = std::exp(0.5 * least / n);
  return out;
}

namespace {

// What each joint of a fit says about itself.
class Examiner {
 public:
  Examiner(const codegen::Model& model, const std::vector<const Dataset*>& data)
      : model_(model),
        data_(data),
        fit_(model, data, kFullRows),
        given_(model.joints()),
        motion_(fit_.Move(given_)),
        result_(fit_.Fit(motion_, given_)) {}

  const ColumnFit& fit() const { return fit_; }
  const ColumnFitResult& result() const { return result_; }

  std::vector<std::string> Notes() const {
    std::vector<std::string> notes;
    for (int j = 0; j < model_.joints(); ++j) {
      if (MovingShare(j) < 0.1 || !(result_.spread[j] > 0)) continue;
      const double left = result_.left[j] / result_.spread[j];
      if (left > kNothing) {
        if (Steps(j) > kWhite && result_.spread[j] > kOverNoise * model_.robot().joint[j].torque_noise_Nm)
          Fail(j,
               "the torque is noise: it changes from sample to sample by as much as it varies at all, and the model "
               "explains nothing of it; expected a measured torque");
        notes.push_back(
            fmt::format("joint {}: the model explains nothing of the torque ({:.0f} % of its spread is left): "
                        "are the kinematics and the columns right?",
                        j + 1, 100 * left));
      }
      if (const std::string said = FedEnergy(j); !said.empty()) notes.push_back(said);
    }
    return notes;
  }

 private:
  [[noreturn]] void Fail(int j, const std::string& what) const {
    throw io::InputError(fmt::format("{}: joint {}: {}", Names(data_), j + 1, what));
  }

  double MovingShare(int j) const {
    return (fit_.signals().qd.col(j).cwiseAbs().array() > model_.robot().joint[j].v_min_radps).cast<double>().mean();
  }

  // Mean square of the torque's steps over twice its variance.
  double Steps(int j) const {
    double steps = 0, variance = 0;
    for (const Dataset* d : data_) {
      const auto tau = d->tau.col(j);
      const Index last = tau.size() - 1;
      steps += (tau.tail(last) - tau.head(last)).squaredNorm();
      variance += 2 * (tau.array() - tau.mean()).square().sum();
    }
    return variance > 0 ? steps / variance : 0;
  }

  std::vector<int> FrictionColumns(int j) const {
    std::vector<int> out;
    for (int c = model_.front_begin(j); c < model_.front_begin(j + 1); ++c)
      if (model_.table()[static_cast<std::size_t>(model_.table_index(c))].group == 1) out.push_back(c);
    return out;
  }

  // Friction torque along the motion, of rows where the joint moves: its mean, the mean's deviation, and the value that
  // 95 % of the rows do not pass.
  struct Drag {
    double mean = 0, sd = 0, high = 0;
    double spread = 0, left = 0;  // of the joint's torque
    bool is_large() const { return -mean > kFedShare * spread; }
    bool feeds() const { return high < 0 && -mean > kSure * sd && (is_large() || -mean > left); }
  };
  Drag DragOf(int j, const ColumnFit::Motion& motion, const ColumnFitResult& result) const {
    const auto at = static_cast<std::size_t>(j);
    const std::vector<int> friction = FrictionColumns(j);
    const auto& speed = fit_.signals().qd.col(j);
    VectorXd pick = VectorXd::Zero(motion.columns);
    std::vector<double> drag;
    for (Index r = 0; r < fit_.rows(); ++r) {
      if (std::abs(speed[r]) < model_.robot().joint[j].v_min_radps) continue;
      const double sign = speed[r] > 0 ? 1 : -1;
      double torque = 0;
      for (std::size_t c = 0; c < motion.column[at].size(); ++c) {
        if (std::find(friction.begin(), friction.end(), motion.column[at][c]) == friction.end()) continue;
        const double value = sign * motion.A[at](r, static_cast<Index>(c));
        pick[motion.column[at][c]] += value;
        torque += value * result.x[motion.column[at][c]];
      }
      drag.push_back(torque);
    }
    if (drag.empty()) return {};
    pick /= static_cast<double>(drag.size());
    std::sort(drag.begin(), drag.end());
    return {pick.dot(result.x), std::sqrt(std::max(0.0, pick.dot(result.covariance * pick))),
            drag[static_cast<std::size_t>(0.95 * static_cast<double>(drag.size() - 1))], result.spread[j],
            result.left[j]};
  }

  // A line if the joint's friction drives it at every speed of the logs. Another joint's motor, coupled to this one, is
  // tried first.
  std::string FedEnergy(int j) const {
    const Drag drag = DragOf(j, motion_, result_);
    if (!drag.feeds()) return "";
    for (int i = 0; i < model_.joints(); ++i) {
      if (i == j || MovingShare(i) < 0.1) continue;
      const auto& speed = fit_.signals().qd.col(i);
      MatrixXd other(fit_.rows(), 2);
      other << speed.cwiseSign(), speed;
      ColumnFit::Motion coupled = motion_;
      coupled.Add(j, other);
      const ColumnFitResult result = fit_.Fit(coupled, given_);
      if (DragOf(j, coupled, result).feeds() || result_.log_left - result.log_left < kClearGain / 4) continue;
      return fmt::format("joint {}: its friction follows the speed of joint {}: are their motors coupled?", j + 1,
                         i + 1);
    }
    ColumnFit::Motion without = motion_;
    without.Remove(j, FrictionColumns(j));
    const double gain = fit_.Fit(without, given_).log_left - result_.log_left;
    const std::string what = fmt::format(
        "friction of {:.3g} {} would drive the joint at every speed, where it must brake it; is the sign of "
        "tau{} or q{} right?",
        drag.mean, TorqueUnit(model_.robot().joint[j]), j + 1, j + 1);
    if (gain > kClearGain && drag.is_large()) Fail(j, what);
    return fmt::format("joint {}: suspect: {}", j + 1, what);
  }

  const codegen::Model& model_;
  const std::vector<const Dataset*>& data_;
  ColumnFit fit_;
  ColumnChange given_;
  ColumnFit::Motion motion_;
  ColumnFitResult result_;
};

// What each joint of one log leaves under a fit of all of them.
VectorXd LeftOn(const codegen::Model& model, const Dataset& log, const ColumnFitResult& all) {
  const ColumnFit one(model, {&log}, kScreenRows);
  if (one.rows() == 0) return VectorXd::Zero(model.joints());
  const ColumnFit::Motion motion = one.Move(ColumnChange(model.joints()));
  VectorXd left(model.joints());
  for (int j = 0; j < model.joints(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    left[j] = std::sqrt((one.tau().col(j) - motion.A[at] * all.x(motion.column[at])).squaredNorm() / one.rows());
  }
  return left;
}

// A joint whose position rests has a torque that its pose, the other joints and stiction explain.
void CheckResting(const codegen::Model& model, const Dataset& log, const VectorXd& left) {
  for (int j = 0; j < model.joints(); ++j) {
    if (log.s.q.col(j).maxCoeff() - log.s.q.col(j).minCoeff() > kRounding) continue;
    const double spread = std::sqrt((log.tau.col(j).array() - log.tau.col(j).mean()).square().mean());
    const double limit = model.robot().joint[j].torque_limit_Nm;
    if (spread < kBraked * limit) continue;  // a brake may hold it
    if (left[j] > kResting * limit && left[j] > kUnexplained * spread)
      throw io::InputError(
          fmt::format("{}: joint {}: position never changes, but its torque varies by {:.3g} that a "
                      "joint at rest does not explain (is the encoder stuck?)",
                      log.source, j + 1, left[j]));
  }
}

[[noreturn]] void RefuseAs(const std::string& what, const std::vector<const Dataset*>& data, double as_given,
                           double changed) {
  throw io::InputError(
      fmt::format("{}: {}: with the columns as they are, a fit leaves {:.1f} % of the torques' spread unexplained; "
                  "with this change {:.1f} %",
                  Names(data), what, 100 * as_given, 100 * changed));
}

void RefuseChange(const codegen::Model& model, const std::vector<const Dataset*>& data) {
  const ColumnGain best = BestColumnChange(model, data);
  if (best.gain < (best.what.starts_with(kWholeJoints) ? kWholeGain : kClearGain)) return;
  RefuseAs(best.what, data, best.as_given, best.changed);
}

// The log as it is if its revolute joints turn `scale` times as far.
Dataset Turned(const codegen::Model& model, const Dataset& log, double scale) {
  Dataset out = log;
  for (int j = 0; j < model.joints(); ++j) {
    if (!Slides(model.robot().joint[j])) out.s.q.col(j) *= scale, out.s.qd.col(j) *= scale, out.s.qdd.col(j) *= scale;
    const double v_min = model.robot().joint[j].v_min_radps;
    out.used.col(j) = (out.sound.col(j).array() != 0 && out.s.qd.col(j).array().abs() > v_min).cast<int>();
  }
  return out;
}

// scale: of the speeds of revolute joints.
bool IsTooFast(const codegen::Model& model, const Dataset& log, double scale) {
  for (int j = 0; j < model.joints(); ++j) {
    const codegen::Joint& joint = model.robot().joint[j];
    const double fastest = (Slides(joint) ? 1 : scale) * log.s.qd.col(j).cwiseAbs().maxCoeff();
    if (fastest > kImpossible * joint.speed_limit_radps) return true;
  }
  return false;
}

// A speed column would tell. Without one the torques do: gravity turns with the true angle. Rows are chosen in the unit
// in which the arm is faster, since few move fast enough in the other one.
void CheckAngleUnit(const codegen::Model& model, const Dataset& log) {
  const int n = model.joints();
  const auto fit = [n](const ColumnFit& rows, const ColumnChange& change) {
    return rows.Fit(rows.Move(change), change);
  };
  for (const bool in_rad : {true, false}) {
    if (IsTooFast(model, log, in_rad ? kDegPerRad : 1)) continue;
    const Dataset turned = in_rad ? Turned(model, log, kDegPerRad) : Dataset();
    const Dataset& faster = in_rad ? turned : log;
    const ColumnFit rows(model, {&faster}, kFullRows);
    if (rows.rows() < kRowsPerColumn * model.columns()) continue;
    ColumnChange slower(n);
    for (int j = 0; j < n; ++j)
      if (!Slides(model.robot().joint[j])) slower.q_scale[static_cast<std::size_t>(j)] = 1 / kDegPerRad;
    const ColumnChange fast(n);
    const ColumnFitResult given = fit(rows, in_rad ? slower : fast), changed = fit(rows, in_rad ? fast : slower);
    double gain = 0;
    int moving = 0;
    for (int j = 0; j < n; ++j) {
      if (faster.s.q.col(j).maxCoeff() - faster.s.q.col(j).minCoeff() < kTurnedBy) continue;
      gain += 2 * std::log(given.left[j] / changed.left[j]);
      ++moving;
    }
    if (moving < 2 || gain < kUnitGain || !NoneWorse(given, changed, fast)) continue;
    RefuseAs(in_rad ? "positions seem to be in rad, but are read as deg"
                    : "positions seem to be in deg, but are read as rad",
             {&log}, std::exp(0.5 * given.log_left / n), std::exp(0.5 * changed.log_left / n));
  }
}

}  // namespace

std::vector<std::string> EquallyGood(const codegen::Model& model, const std::vector<const Dataset*>& data) {
  const int n = model.joints();
  const ColumnFit fit(model, data, kScreenRows);
  if (fit.rows() < kRowsPerColumn * model.columns()) return {};
  const ColumnChange given(n);
  const double least = fit.Fit(fit.Move(given), given).log_left;
  std::vector<std::string> out;
  const auto add = [&](const ColumnChange& change, const std::string& what) {
    if (fit.Fit(fit.Move(change), change).log_left < least + kClearGain) out.push_back(what);
  };
  for (int i = 0; i < n; ++i) {
    ColumnChange signs(n);
    signs.q_scale[static_cast<std::size_t>(i)] = signs.tau_sign[static_cast<std::size_t>(i)] = -1;
    add(signs, fmt::format("the sign of q{0} with tau{0}", i + 1));
    for (int j = i + 1; j < n; ++j) {
      ColumnChange joints(n);
      Exchange(joints.q, i, j), Exchange(joints.tau, i, j);
      add(joints, fmt::format("joints {} and {} exchanged", i + 1, j + 1));
    }
  }
  for (const double pace : {10.0, 0.1}) {
    ColumnChange time(n);
    time.pace = pace;
    add(time, fmt::format("time {} by 10", pace > 1 ? "divided" : "multiplied"));
  }
  return out;
}

std::vector<std::string> CheckColumns(const codegen::Model& model, const std::vector<const Dataset*>& data) {
  if (ColumnFit(model, data, kFullRows).rows() < kRowsPerColumn * model.columns()) return {};
  const Examiner all(model, data);
  for (const Dataset* log : data) {
    CheckAngleUnit(model, *log);
    const VectorXd left = LeftOn(model, *log, all.result());
    CheckResting(model, *log, left);
    double above = 0;
    for (int j = 0; j < model.joints(); ++j)
      if (left[j] > 0) above += 2 * std::log(left[j] / std::max(all.result().left[j], 1e-9 * left[j]));
    if (data.size() > 1 && above > kForeign) RefuseChange(model, {log});
  }
  RefuseChange(model, data);
  std::vector<std::string> notes = all.Notes();
  for (std::string& note : notes) note = Names(data) + ": " + note;
  return notes;
}

}  // namespace armcal::calibration
