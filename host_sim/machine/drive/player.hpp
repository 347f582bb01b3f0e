// drive - moves the set-point: it holds, blends to the start, plays a trajectory, and stops.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>

#include <Eigen/Core>

#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/machine/drive/firmware.hpp"

namespace armcal::drive {

struct SetPoint {
  Eigen::VectorXd q, qd, qdd;
};

struct MotionLimits {
  Eigen::VectorXd speed_radps, acceleration_radps2;
};

// Load, Command and the getters belong to the background, Step to the tick.
class Player final : public PlayedMotion {
 public:
  // A joint further than this from its set-point stops the motion.
  static constexpr double kMaxTrackingError_rad = 0.2;

  Player(int joints, double tick_s, MotionLimits limits);

  bool Load(double step_s, std::uint32_t points, const float* q) override;
  void SetSpeed(double share) override { speed_.store(share); }
  // Waits for its turn. A stop drops what waits.
  void Command(client::PlayerCommand command) override;

  client::PlayerState state() const override { return state_.load(); }
  client::StopReason reason() const override { return reason_.load(); }
  std::uint32_t first_tick() const override { return first_tick_.load(); }  // of the played part
  std::uint32_t last_tick() const override { return last_tick_.load(); }
  bool command_pending() const;

  // One tick: takes a command, moves the set-point. settled: the arm rests, and a command may be taken; during a motion
  // one may always. Context: tick.
  const SetPoint& Step(std::uint32_t tick, const Eigen::VectorXd& q_measured, bool settled);

 private:
  client::PlayerCommand TakeCommand(bool settled);
  void Obey(client::PlayerCommand command, const Eigen::VectorXd& q_measured);
  void Hold(const Eigen::VectorXd& q);
  void Stop(client::StopReason reason, const Eigen::VectorXd& q);

  int joints_;
  double tick_s_;
  MotionLimits limits_;
  std::shared_ptr<const trajectory::TrajectorySpline> loaded_, playing_;
  std::atomic<double> speed_{1.0};
  mutable std::mutex mutex_;
  std::deque<client::PlayerCommand> commands_;  // by mutex_
  std::atomic<client::PlayerState> state_{client::PlayerState::kDisabled};
  std::atomic<client::StopReason> reason_{client::StopReason::kNone};
  std::atomic<std::uint32_t> first_tick_{0}, last_tick_{0};
  SetPoint set_;
  Eigen::VectorXd blend_from_, blend_to_;
  double blend_s_ = 0, time_s_ = 0, share_ = 1;
};

}  // namespace armcal::drive
