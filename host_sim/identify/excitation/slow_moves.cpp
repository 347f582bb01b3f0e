// excitation - the cells of the slow part; knows no model.
#include "host_sim/identify/excitation/slow_moves.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::excitation {
namespace {

constexpr double kCell_s = 3.5;
constexpr double kSlowest = 3, kReversal = 5;  // times v_min
constexpr double kFastest = 0.3;               // of the speed limit
constexpr int kReversals = 8;                  // strokes of the cell of small reversals
constexpr double kShortestBlend_s = 0.15;      // keeps the jerk of slow strokes small
constexpr double kAccelerationShare = 0.5;     // of the limit: friction shows best while inertia is quiet

// A smooth step 10 x^3 - 15 x^4 + 6 x^5 rises with a slope of at most 15/8.
constexpr double kSteepest = 1.875;

// Integral of the smooth step from 0 to x, for any x.
double StepIntegral(double x) {
  if (x <= 0) return 0;
  if (x >= 1) return x - 0.5;
  return x * x * x * x * (2.5 + x * (x - 3));
}

// Out into `direction` if the room there allows the reach, else the other way.
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
    // The change from +v to -v must fit into a quarter of the cell, the way out into the room.
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

}  // namespace armcal::excitation
