// excitation - blends, slow moves, and the grid that the parts are put on.
#include "host_sim/identify/excitation/compose.hpp"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/excitation/peaks.hpp"

namespace armcal::excitation {

namespace {

constexpr double kShortest_s = 0.5, kLongest_s = 20, kGrowth = 1.15;
constexpr int kMostEntries = 10;  // places of the series that are tried as its beginning
constexpr int kCheckPoints =
    200;  // the peaks of a polynomial of degree 5 between these points differ by less than 1e-3

bool Keeps(const Observation& observation, const Blend& blend, const Limits& limits) {
  const auto points = [&](Eigen::Index count) { return Eigen::VectorXd::LinSpaced(count, 0, blend.duration_s()); };
  if (!Keeps(FindPeaks(observation, blend.At(points(kCheckPoints))), limits.share)) return false;
  return !limits.clearance ||
         limits.clearance->Keeps(blend.At(points(std::lround(blend.duration_s() / kCheckStep_s) + 1)).q);
}

// Where a joint rests before (direction -1) or after (+1) a blend of this duration from or to the state. It moves at
// the average of zero and its speed for the duration. The place is kept inside the position limits.
State RestNear(const codegen::Robot& robot, const State& moving, double direction, double duration_s, double share) {
  Eigen::VectorXd q = moving.q + direction * duration_s / 2 * moving.qd;
  for (int j = 0; j < robot.joints(); ++j) {
    const auto [low, high] = robot.joint[j].position_limit_rad;
    const double middle = (low + high) / 2, half = share * (high - low) / 2;
    q[j] = std::clamp(q[j], middle - half, middle + half);
  }
  return AtRest(q);
}

template <class Make>
std::optional<Blend> Shortest(const Observation& observation, const Limits& limits, Make make) {
  for (double duration = kShortest_s; duration < kLongest_s; duration *= kGrowth)
    if (Blend blend = make(duration); Keeps(observation, blend, limits)) return blend;
  return std::nullopt;
}

}  // namespace

State AtRest(const Eigen::VectorXd& q) { return {q, Eigen::VectorXd::Zero(q.size()), Eigen::VectorXd::Zero(q.size())}; }

Blend::Blend(const State& from, const State& to, double duration_s)
    : duration_s_(duration_s), power_(from.q.size(), 6) {
  const double T = duration_s;
  const Eigen::VectorXd v0 = T * from.qd, a0 = T * T * from.qdd, a1 = T * T * to.qdd;
  // The difference between the end and the start's parabola there, in position, speed and acceleration.
  const Eigen::VectorXd q = to.q - from.q - v0 - a0 / 2, v = T * to.qd - v0 - a0, a = a1 - a0;
  power_ << from.q, v0, a0 / 2, 10 * q - 4 * v + a / 2, -15 * q + 7 * v - a, 6 * q - 3 * v + a / 2;
}

Eigen::VectorXd Blend::Position(double t_s) const {
  const double x = t_s / duration_s_;
  Eigen::VectorXd q = power_.col(5);
  for (int k = 4; k >= 0; --k) q = q * x + power_.col(k);
  return q;
}

codegen::Signals Blend::At(const Eigen::VectorXd& t) const {
  codegen::Signals s;
  s.t = t;
  Eigen::MatrixXd x[3];  // derivatives of 1, x, .., x^5 by t
  for (auto& m : x) m = Eigen::MatrixXd::Zero(t.size(), 6);
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    const double u = t[k] / duration_s_;
    x[0].row(k) << 1, u, u * u, u * u * u, u * u * u * u, u * u * u * u * u;
    for (int order = 1; order < 3; ++order)
      for (int power = 1; power < 6; ++power) x[order](k, power) = power * x[order - 1](k, power - 1) / duration_s_;
  }
  s.q = x[0] * power_.transpose(), s.qd = x[1] * power_.transpose(), s.qdd = x[2] * power_.transpose();
  return s;
}

std::optional<Blend> ShortestBlend(const Observation& observation, const State& from, const State& to,
                                   const Limits& limits) {
  return Shortest(observation, limits, [&](double duration) { return Blend(from, to, duration); });
}

std::optional<Blend> ShortestStart(const Observation& observation, const State& to, const Limits& limits) {
  const codegen::Robot& robot = observation.model().robot();
  return Shortest(observation, limits, [&](double duration) {
    return Blend(RestNear(robot, to, -1, duration, limits.share), to, duration);
  });
}

std::optional<Blend> ShortestStop(const Observation& observation, const State& from, const Limits& limits) {
  const codegen::Robot& robot = observation.model().robot();
  return Shortest(observation, limits, [&](double duration) {
    return Blend(from, RestNear(robot, from, +1, duration, limits.share), duration);
  });
}

namespace {

constexpr double kCell_s = 3.5;
constexpr double kSlowest = 3, kReversal = 5;  // times v_min
constexpr double kFastest = 0.3;               // of the speed limit
constexpr int kReversals = 8;                  // strokes of the cell of small reversals
constexpr double kShortestBlend_s = 0.15;      // keeps the jerk of slow strokes small
constexpr double kAccelerationShare = 0.5;     // of the limit: friction shows best while inertia needs little torque

// A smooth step 10 x^3 - 15 x^4 + 6 x^5 rises with a slope of at most 15/8.
constexpr double kSteepest = 1.875;

// Integral of the smooth step from 0 to x, for any x.
double StepIntegral(double x) {
  if (x <= 0) return 0;
  if (x >= 1) return x - 0.5;
  return x * x * x * x * (2.5 + x * (x - 3));
}

// `direction` if the room there is enough for the reach, else the other one.
double Toward(double direction, double reach, double room_up, double room_down) {
  return reach <= (direction > 0 ? room_up : room_down) ? direction : -direction;
}

}  // namespace

Strokes::Strokes(double duration_s, int strokes, double speed_radps, double blend_s)
    : duration_s_(duration_s), speed_radps_(speed_radps), blend_s_(blend_s), strokes_(strokes) {}

double Strokes::Offset(double t_s) const {
  const double stroke_s = (duration_s_ - blend_s_) / strokes_;
  double sum = 0;
  for (int k = 0; k <= strokes_; ++k) {
    const double change = (k == 0 || k == strokes_ ? 1 : 2) * (k % 2 == 0 ? 1 : -1);
    sum += change * StepIntegral((t_s - k * stroke_s) / blend_s_);
  }
  return speed_radps_ * blend_s_ * sum;
}

double Strokes::reach_rad() const { return std::abs(Offset((duration_s_ - blend_s_) / strokes_ + blend_s_ / 2)); }

SlowMoves::SlowMoves(const codegen::Robot& robot, const Eigen::VectorXd& home, int speeds, double share, double reach)
    : home_(home), cell_(robot.joints()) {
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const auto [low, high] = joint.position_limit_rad;
    const double middle = (low + high) / 2, half = share * (high - low) / 2;
    const double room_up = middle + half - home[j], room_down = home[j] - middle + half;
    const double acceleration = kAccelerationShare * share * joint.acceleration_limit_radps2;
    // The change from +v to -v must fit into a quarter of the cell, and the way out must fit into the room.
    const double fastest =
        std::min({reach * kFastest * joint.speed_limit_radps, acceleration * kCell_s / 4 / (2 * kSteepest),
                  std::max(room_up, room_down) / (kCell_s / 2)});
    const double slowest = std::min(kSlowest * joint.v_min_radps, fastest);
    const auto cell = [&](int strokes, double speed, double direction) {
      const double blend = std::max(kShortestBlend_s, 2 * kSteepest * speed / acceleration);
      const double size = Strokes(kCell_s, strokes, speed, blend).reach_rad();
      return Strokes(kCell_s, strokes, Toward(direction, size, room_up, room_down) * speed, blend);
    };
    for (int k = 0; k < speeds; ++k) {
      const double speed =
          slowest * std::pow(fastest / slowest, speeds > 1 ? static_cast<double>(k) / (speeds - 1) : 1);
      cell_[j].push_back(cell(2, speed, (j + k) % 2 ? -1 : 1));
    }
    cell_[j].push_back(cell(kReversals, std::min(kReversal * joint.v_min_radps, fastest), j % 2 ? -1 : 1));
    std::rotate(cell_[j].begin(), cell_[j].begin() + j % static_cast<int>(cell_[j].size()), cell_[j].end());
  }
}

double SlowMoves::duration_s() const { return kCell_s * static_cast<double>(cell_[0].size()); }

Eigen::VectorXd SlowMoves::Position(double t_s) const {
  const auto last = static_cast<double>(cell_[0].size() - 1);
  const double cell = std::clamp(std::floor(t_s / kCell_s), 0.0, last);
  Eigen::VectorXd q = home_;
  for (Eigen::Index j = 0; j < q.size(); ++j)
    q[j] += cell_[j][static_cast<std::size_t>(cell)].Offset(t_s - cell * kCell_s);
  return q;
}

namespace {

struct Part {
  std::string name;
  double duration_s;
  std::function<Eigen::VectorXd(double)> position;
};

Part AsPart(const std::string& name, const Blend& blend) {
  return {name, blend.duration_s(), [blend](double t) { return blend.Position(t); }};
}

State StateAt(const Series& series, double t_s) {
  const codegen::Signals s = series.At(Eigen::VectorXd::Constant(1, t_s));
  return {s.q.row(0), s.qd.row(0), s.qdd.row(0)};
}

// Instants of the period, sorted: first those at which speed and acceleration are small.
std::vector<double> QuietInstants(const codegen::Robot& robot, const Series& series) {
  constexpr int kInstants = 100;
  const double period = series.period_s;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(kInstants, 0, period * (kInstants - 1) / kInstants);
  const codegen::Signals s = series.At(t);
  Eigen::VectorXd unrest = Eigen::VectorXd::Zero(kInstants);
  for (int j = 0; j < robot.joints(); ++j)
    unrest = unrest.cwiseMax(s.qd.col(j).cwiseAbs() / robot.joint[j].speed_limit_radps)
                 .cwiseMax(s.qdd.col(j).cwiseAbs() / robot.joint[j].acceleration_limit_radps2);
  std::vector<double> instants(t.data(), t.data() + kInstants);
  std::vector<int> order(kInstants);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return unrest[a] < unrest[b]; });
  std::transform(order.begin(), order.end(), instants.begin(), [&](int k) { return t[k]; });
  return instants;
}

[[noreturn]] void Fail(const Observation& observation, const std::string& what) {
  throw io::InputError(observation.model().robot().path + ": " + what);
}

std::string Expected(const Limits& limits) {
  return limits.clearance ? "; expected wider limits, more room in the cell, or a smaller --clearance"
                          : "; expected wider limits";
}

using Parts = std::vector<Part>;

// Empty: `lacks` says what was not found.
std::optional<Part> SlowPart(const Observation& observation, const Eigen::VectorXd& home, int speeds,
                             const Limits& limits, std::string& lacks) {
  codegen::Signals motion;
  for (const double reach : {1.0, 0.5, 0.25, 0.125}) {
    const SlowMoves moves(observation.model().robot(), home, speeds, limits.share, reach);
    trajectory::Trajectory path;
    path.q.resize(static_cast<Eigen::Index>(moves.duration_s() / path.step_s) + 1, home.size());
    for (Eigen::Index k = 0; k < path.q.rows(); ++k)
      path.q.row(k) = moves.Position(path.step_s * static_cast<double>(k));
    motion = Sampled(trajectory::TrajectorySpline(path), path.step_s);
    if (!Keeps(observation, motion, limits)) continue;
    return Part{"slow moves", moves.duration_s(), [moves](double t) { return moves.Position(t); }};
  }
  if (limits.clearance && !limits.clearance->Keeps(motion.q)) {
    const collision::Nearest nearest = limits.clearance->Smallest(motion.q);
    lacks = fmt::format(
        "slow moves that keep {} and {} {:.1f} mm apart (they come to {:.1f} mm); expected a smaller --clearance, or "
        "--no-slow",
        nearest.a, nearest.b, 1e3 * limits.clearance->margin_m(), 1e3 * nearest.distance_m);
  } else {
    lacks = "slow moves within the limits; expected --no-slow or limits that allow them";
  }
  return std::nullopt;
}

// Slow moves around home, between `from` and `to`; without speeds, just the way from one to the other. Empty: `lacks`
// says what was not found.
std::optional<Parts> SlowParts(const Observation& observation, const Eigen::VectorXd& from, const Eigen::VectorXd& home,
                               const Eigen::VectorXd& to, int speeds, const Limits& limits, std::string& lacks) {
  const auto move = [&](const Eigen::VectorXd& begin, const Eigen::VectorXd& end) {
    return ShortestBlend(observation, AtRest(begin), AtRest(end), limits);
  };
  Parts parts;
  if (speeds > 0) {
    const auto slow = SlowPart(observation, home, speeds, limits, lacks);
    if (!slow) return std::nullopt;
    const auto transfer = move(from, home);
    if (!transfer) return lacks = "transfer within the limits" + Expected(limits), std::nullopt;
    parts = {AsPart("transfer", *transfer), *slow};
  }
  const auto back = move(speeds > 0 ? home : from, to);
  if (!back) return lacks = "return within the limits" + Expected(limits), std::nullopt;
  parts.push_back(AsPart("return", *back));
  return parts;
}

// The blend in, the periods, the blend out, which ends at rest, and what follows.
Parts AllParts(const Observation& observation, const Series& series, const ComposeSettings& settings,
               const Limits& limits) {
  std::string lacks = "blend from rest into the series within the limits" + Expected(limits);
  int tried = 0;
  for (const double begin : QuietInstants(observation.model().robot(), series)) {
    const State state = StateAt(series, begin);
    const auto in = ShortestStart(observation, state, limits), out = ShortestStop(observation, state, limits);
    if (!in || !out) continue;
    const auto position = [series, begin](double t) -> Eigen::VectorXd { return StateAt(series, begin + t).q; };
    Parts parts{AsPart("blend in", *in),
                {Name(series.family), settings.periods * series.period_s, position},
                AsPart("blend out", *out)};
    const Eigen::VectorXd first = in->Position(0), last = out->Position(out->duration_s());
    for (const Eigen::VectorXd& home : {Eigen::VectorXd(series.offset()), last}) {
      const auto more = SlowParts(observation, last, home, first, settings.slow_speeds, limits, lacks);
      if (!more) continue;
      parts.insert(parts.end(), more->begin(), more->end());
      return parts;
    }
    if (++tried == kMostEntries) break;
  }
  Fail(observation, "no " + lacks);
}

// One point each step_s of the parts in a row. Where the end falls between two points, its pose is added once more.
Composed OnGrid(const std::vector<Part>& parts, double step_s) {
  Composed composed;
  double end = 0;
  for (const Part& p : parts) composed.sections.push_back({p.name, end, end + p.duration_s}), end += p.duration_s;
  const auto points = static_cast<Eigen::Index>(std::ceil(end / step_s - 1e-9)) + 1;
  composed.trajectory.step_s = step_s;
  composed.trajectory.q.resize(points, parts[0].position(0).size());
  std::size_t at = 0;
  for (Eigen::Index k = 0; k < points; ++k) {
    const double t = std::min(step_s * static_cast<double>(k), end);
    while (at + 1 < parts.size() && t >= composed.sections[at].end_s) ++at;
    composed.trajectory.q.row(k) = parts[at].position(t - composed.sections[at].begin_s);
  }
  return composed;
}

}  // namespace

Composed Compose(const Observation& observation, const Series& series, const ComposeSettings& settings) {
  const Limits limits(1 - settings.margin, settings.clearance);
  Composed composed = OnGrid(AllParts(observation, series, settings, limits), settings.step_s);
  const codegen::Signals motion = Sampled(trajectory::TrajectorySpline(composed.trajectory));
  composed.peaks = FindPeaks(observation, motion);
  if (limits.clearance) composed.nearest = limits.clearance->Smallest(motion.q);
  if (!Keeps(composed.peaks, 1))
    Fail(observation, "the trajectory's grid is too coarse to keep the limits; expected a smaller step");
  if (limits.clearance && composed.nearest.distance_m < limits.clearance->margin_m())
    Fail(observation, "the trajectory's grid is too coarse to keep the distances; expected a smaller step");
  return composed;
}

}  // namespace armcal::excitation
