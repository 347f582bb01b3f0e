// excitation - puts the parts on one grid; knows no search.
#include "host_sim/identify/excitation/compose.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/excitation/blend.hpp"
#include "host_sim/identify/excitation/slow_moves.hpp"

namespace armcal::excitation {
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

// Instants of the period, those at which the arm is slow and hardly accelerated first.
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

// In, the periods, out; ends at rest.
std::vector<Part> SeriesParts(const Observation& observation, const Series& series, int periods, double share) {
  for (const double begin : QuietInstants(observation.model().robot(), series)) {
    const State state = StateAt(series, begin);
    const auto in = ShortestStart(observation, state, share), out = ShortestStop(observation, state, share);
    if (!in || !out) continue;
    const auto position = [series, begin](double t) -> Eigen::VectorXd { return StateAt(series, begin + t).q; };
    return {
        AsPart("blend in", *in), {Name(series.family), periods * series.period_s, position}, AsPart("blend out", *out)};
  }
  Fail(observation, "no blend from rest into the series within the limits; expected wider limits");
}

std::optional<Part> SlowPart(const Observation& observation, const Eigen::VectorXd& home, int speeds, double share) {
  for (const double reach : {1.0, 0.5, 0.25, 0.125}) {
    const SlowMoves moves(observation.model().robot(), home, speeds, share, reach);
    trajectory::Trajectory path;
    path.q.resize(static_cast<Eigen::Index>(moves.duration_s() / path.step_s) + 1, home.size());
    for (Eigen::Index k = 0; k < path.q.rows(); ++k)
      path.q.row(k) = moves.Position(path.step_s * static_cast<double>(k));
    if (!Keeps(FindPeaks(observation, Sampled(trajectory::TrajectorySpline(path), path.step_s)), share)) continue;
    return Part{"slow moves", moves.duration_s(), [moves](double t) { return moves.Position(t); }};
  }
  return std::nullopt;
}

Part Transfer(const Observation& observation, const std::string& name, const Eigen::VectorXd& from,
              const Eigen::VectorXd& to, double share) {
  const auto blend = ShortestBlend(observation, AtRest(from), AtRest(to), share);
  if (!blend)
    Fail(observation, "no " + name + " within the limits; expected limits that allow a move between its poses");
  return AsPart(name, *blend);
}

// One point each step_s of the parts in a row; the end pose is added once more where it falls between two points.
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
  const double share = 1 - settings.margin;
  std::vector<Part> parts = SeriesParts(observation, series, settings.periods, share);
  const Eigen::VectorXd first = parts.front().position(0);
  Eigen::VectorXd pose = parts.back().position(parts.back().duration_s);
  if (settings.slow_speeds > 0) {
    const Eigen::VectorXd home = series.offset();
    const auto slow = SlowPart(observation, home, settings.slow_speeds, share);
    if (!slow) Fail(observation, "no slow moves within the limits; expected --no-slow or limits that allow them");
    parts.push_back(Transfer(observation, "transfer", pose, home, share));
    parts.push_back(*slow);
    pose = home;
  }
  parts.push_back(Transfer(observation, "return", pose, first, share));

  Composed composed = OnGrid(parts, settings.step_s);
  composed.peaks = FindPeaks(observation, Sampled(trajectory::TrajectorySpline(composed.trajectory)));
  if (!Keeps(composed.peaks, 1))
    Fail(observation, "the trajectory's grid is too coarse to keep the limits; expected a smaller step");
  return composed;
}

}  // namespace armcal::excitation
