// drive - computes the set-point: a quintic blend to the first point, then the spline at the commanded speed.
#include "host_sim/machine/drive/player.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::drive {
namespace {
constexpr double kBlendSpeedShare = 0.3, kBlendAccelerationShare = 0.3, kShortestBlend_s = 1.0;
}

Player::Player(int joints, double tick_s, MotionLimits limits)
    : joints_(joints), tick_s_(tick_s), limits_(std::move(limits)) {
  Hold(Eigen::VectorXd::Zero(joints));
}

bool Player::Load(double step_s, std::uint32_t points, const float* q) {
  if (moving()) return false;
  trajectory::Trajectory trajectory;
  trajectory.step_s = step_s;
  trajectory.q =
      Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(q, points, joints_)
          .cast<double>();
  loaded_ = std::make_shared<const trajectory::TrajectorySpline>(trajectory);
  return true;
}

void Player::Hold(const Eigen::VectorXd& q) {
  set_.q = q;
  set_.qd = set_.qdd = Eigen::VectorXd::Zero(joints_);
}

void Player::Stop(client::StopReason reason, const Eigen::VectorXd& q) {
  Hold(q);
  reason_ = reason;
  state_ = client::PlayerState::kStopped;
}

void Player::Command(client::PlayerCommand command) {
  const std::lock_guard lock(mutex_);
  if (command == client::PlayerCommand::kStop) commands_.clear();
  if (command != client::PlayerCommand::kNone) commands_.push_back(command);
}

bool Player::command_pending() const {
  const std::lock_guard lock(mutex_);
  return !commands_.empty();
}

client::PlayerCommand Player::TakeCommand(bool settled) {
  const std::lock_guard lock(mutex_);
  if (commands_.empty() || (!settled && !moving())) return client::PlayerCommand::kNone;
  const client::PlayerCommand next = commands_.front();
  commands_.pop_front();
  return next;
}

void Player::Obey(client::PlayerCommand command, const Eigen::VectorXd& q) {
  switch (command) {
    case client::PlayerCommand::kNone:
      return;
    case client::PlayerCommand::kEnable:
      if (state() != client::PlayerState::kDisabled) return;
      Hold(q);
      reason_ = client::StopReason::kNone;
      state_ = client::PlayerState::kHolding;
      return;
    case client::PlayerCommand::kDisable:
      state_ = client::PlayerState::kDisabled;
      return;
    case client::PlayerCommand::kStop:
      if (moving()) Stop(client::StopReason::kCommand, q);
      return;
    case client::PlayerCommand::kStart:
      if (state() == client::PlayerState::kDisabled || moving()) return;
      playing_ = loaded_;
      if (!playing_) return Stop(client::StopReason::kNoTrajectory, set_.q);
      share_ = std::clamp(speed_.load(), 0.01, 1.0);
      blend_from_ = set_.q;
      blend_to_ = playing_->Position(0);
      blend_s_ = kShortestBlend_s;
      for (int j = 0; j < joints_; ++j) {  // a quintic's peaks: 1.875 d/T and 5.77 d/T^2
        const double d = std::abs(blend_to_[j] - blend_from_[j]);
        blend_s_ = std::max({blend_s_, 1.875 * d / (kBlendSpeedShare * share_ * limits_.speed_radps[j]),
                             std::sqrt(5.7736 * d / (kBlendAccelerationShare * limits_.acceleration_radps2[j]))});
      }
      time_s_ = 0;
      reason_ = client::StopReason::kNone;
      state_ = client::PlayerState::kBlending;
  }
}

const SetPoint& Player::Step(std::uint32_t tick, const Eigen::VectorXd& q_measured, bool settled) {
  Obey(TakeCommand(settled), q_measured);
  if (!enabled()) Hold(q_measured);
  if (moving() && (q_measured - set_.q).cwiseAbs().maxCoeff() > kMaxTrackingError_rad)
    Stop(client::StopReason::kTrackingError, q_measured);
  if (state() == client::PlayerState::kBlending) {
    time_s_ += tick_s_;
    const double u = std::min(1.0, time_s_ / blend_s_);
    const Eigen::VectorXd d = blend_to_ - blend_from_;
    set_.q = blend_from_ + d * (u * u * u * (10 + u * (6 * u - 15)));
    set_.qd = d * (30 * u * u * (1 - u) * (1 - u) / blend_s_);
    set_.qdd = d * (60 * u * (1 - u) * (1 - 2 * u) / (blend_s_ * blend_s_));
    if (u >= 1) {
      time_s_ = 0;
      first_tick_ = tick + 1;
      state_ = client::PlayerState::kPlaying;
    }
  } else if (state() == client::PlayerState::kPlaying) {
    time_s_ += tick_s_ * share_;
    set_.q = playing_->Position(time_s_);
    set_.qd = share_ * playing_->Speed(time_s_);
    set_.qdd = share_ * share_ * playing_->Acceleration(time_s_);
    last_tick_ = tick;
    if (time_s_ >= playing_->duration_s()) {
      Hold(playing_->Position(playing_->duration_s()));
      state_ = client::PlayerState::kFinished;
    }
  }
  return set_;
}

}  // namespace armcal::drive
