// excitation - quintic blends and the search for their duration; knows no trajectory family.
#include "host_sim/identify/excitation/blend.hpp"

#include <algorithm>

#include "host_sim/identify/excitation/peaks.hpp"

namespace armcal::excitation {
namespace {

constexpr double kShortest_s = 0.5, kLongest_s = 20, kGrowth = 1.15;
constexpr int kCheckPoints = 200;  // a polynomial of degree 5: its peaks between these differ by less than 1e-3

bool Keeps(const Observation& observation, const Blend& blend, double share) {
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(kCheckPoints, 0, blend.duration_s());
  return Keeps(FindPeaks(observation, blend.At(t)), share);
}

// Where a joint rests before (direction -1) or after (+1) a blend of this duration from or to the state: the average of
// zero and its speed, for the duration; kept inside the position limits.
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
std::optional<Blend> Shortest(const Observation& observation, double share, Make make) {
  for (double duration = kShortest_s; duration < kLongest_s; duration *= kGrowth)
    if (Blend blend = make(duration); Keeps(observation, blend, share)) return blend;
  return std::nullopt;
}

}  // namespace

State AtRest(const Eigen::VectorXd& q) { return {q, Eigen::VectorXd::Zero(q.size()), Eigen::VectorXd::Zero(q.size())}; }

Blend::Blend(const State& from, const State& to, double duration_s)
    : duration_s_(duration_s), power_(from.q.size(), 6) {
  const double T = duration_s;
  const Eigen::VectorXd v0 = T * from.qd, a0 = T * T * from.qdd, a1 = T * T * to.qdd;
  // What the end still needs beyond the start's parabola, in position, speed and acceleration.
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

std::optional<Blend> ShortestBlend(const Observation& observation, const State& from, const State& to, double share) {
  return Shortest(observation, share, [&](double duration) { return Blend(from, to, duration); });
}

std::optional<Blend> ShortestStart(const Observation& observation, const State& to, double share) {
  const codegen::Robot& robot = observation.model().robot();
  return Shortest(observation, share,
                  [&](double duration) { return Blend(RestNear(robot, to, -1, duration, share), to, duration); });
}

std::optional<Blend> ShortestStop(const Observation& observation, const State& from, double share) {
  const codegen::Robot& robot = observation.model().robot();
  return Shortest(observation, share,
                  [&](double duration) { return Blend(from, RestNear(robot, from, +1, duration, share), duration); });
}

}  // namespace armcal::excitation
