// plant - solves the equations of motion: friction, sticking, breaking loose, integration within a tick.
#include <algorithm>
#include <cmath>

#include "host_sim/machine/plant/arm.hpp"
#include "host_sim/machine/plant/joint_effects.hpp"

namespace armcal::plant {

Eigen::VectorXd Arm::CurrentAfter(double duration_s) const {
  // The command runs on with its slope; exact for the first-order lag.
  const double lag_s = scenario_.current_time_constant_s;
  return command_ + slope_ * (duration_s - lag_s) +
         (current_ - command_ + slope_ * lag_s) * std::exp(-duration_s / lag_s);
}

JointState Arm::StateOf(int joint, int direction, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                        const ActingEffect& effect) const {
  const std::size_t j = static_cast<std::size_t>(joint);
  const auto all = [](const Eigen::VectorXd& v) { return std::span(v.data(), static_cast<std::size_t>(v.size())); };
  return {.q_rad = q[joint],
          .qd_radps = qd[joint],
          .direction = direction,
          .load_Nm = load_[joint],
          .temperature_degC = temperature_[joint],
          .motor_angle_rad = motor_angle_[joint],
          .coulomb_Nm = truth_.coulomb_Nm[j],
          .viscous_Nm = truth_.viscous_Nmsprad[j] * qd[joint],
          .since_s = time_s_ - effect.placed.from_s,
          .memory = effect.memory,
          .all_q = all(q),
          .all_qd = all(qd),
          .all_load = all(load_),
          .all_motor = all(motor_angle_)};
}

Arm::JointTorques Arm::TorquesAt(int joint, int direction, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                                 bool breaking_loose) const {
  const std::size_t j = static_cast<std::size_t>(joint);
  const double coulomb = truth_.coulomb_Nm[j], viscous = truth_.viscous_Nmsprad[j] * qd[joint];
  JointTorques sum{breaking_loose ? scenario_.stick_ratio * coulomb : coulomb, viscous, 0, 0};
  double dry = 0;
  for (const ActingEffect& acting : effects_[j]) {
    if (time_s_ < acting.placed.from_s) continue;
    const JointState state = StateOf(joint, direction, q, qd, acting);
    const JointEffect& effect = *acting.placed.effect;
    const double drag = effect.Drag(state), position = effect.Torque(state);
    dry += effect.DryLevel(state);
    sum.drag += drag;
    sum.position += position;
    sum.undeclared += drag + position;
  }
  dry = std::max(dry, -sum.dry);  // friction never pushes
  sum.dry += dry;
  sum.undeclared += direction * dry;
  return sum;
}

Eigen::MatrixXd Arm::Mass(const Eigen::VectorXd& q) {
  Eigen::MatrixXd mass;
  Eigen::VectorXd bias;
  links_->MassAndBias(q, Eigen::VectorXd::Zero(joints()), mass, bias);
  return mass + rotors_;
}

void Arm::FormDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& ahead,
                       const Eigen::VectorXd& ahead_rate) {
  link_q_ = q + ahead;
  link_qd_ = qd + ahead_rate;
  links_->MassAndBias(link_q_, link_qd_, link_mass_, bias_);
  mass_ = link_mass_ + rotors_;
  for (int j = 0; j < joints(); ++j) motor_angle_[j] = robot_.joint[static_cast<std::size_t>(j)].gear_ratio * q[j];
  passed_Nm_.setZero();
  for (const Transmission& gear : scenario_.transmissions)
    passed_Nm_[gear.joint] = gear.Torque(ahead[gear.joint], ahead_rate[gear.joint]);
  if (forces_.empty()) return;
  outside_Nm_.setZero();
  for (const ActingForce& acting : forces_) {
    if (time_s_ < acting.from_s) continue;
    const KDL::Vector place = links_->Place(link_q_, acting.link, acting.point, jacobian_);
    const Eigen::Vector3d speed = jacobian_ * link_qd_;
    const KDL::Vector f = acting.force->At(place, KDL::Vector(speed[0], speed[1], speed[2]), time_s_ - acting.from_s);
    outside_Nm_ -= jacobian_.transpose() * Eigen::Vector3d(f.x(), f.y(), f.z());
  }
  bias_ += outside_Nm_;
}

// M qdd = drive - bias - friction with resting joints constrained to qdd = 0: their rows and columns become unit ones.
// A link behind an elastic gear is driven by what the gear passes on, and its motor by the rest.
// Tooth friction depends on the gear's load, which depends on qdd; starting from the last load, two rounds leave an
// error of mu^2 times the load's change in half an integration step.
void Arm::Accelerate(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& current,
                     Eigen::VectorXd& qdd) {
  const int n = joints();
  drive_ = JointTorque(current, truth_.torque_constant_NmpA);
  constrained_ = mass_;
  for (int j = 0; j < n; ++j) {
    if (gears_[static_cast<std::size_t>(j)]) {
      constrained_(j, j) = link_mass_(j, j);
      continue;
    }
    if (direction_[static_cast<std::size_t>(j)] != 0) continue;
    constrained_.row(j).setZero();
    constrained_.col(j).setZero();
    constrained_(j, j) = 1;
  }
  factor_.compute(constrained_);
  for (int round = 0; round < 2; ++round) {
    for (int j = 0; j < n; ++j) {
      const int direction = direction_[static_cast<std::size_t>(j)];
      const JointTorques t = TorquesAt(j, direction, q, qd, false);
      friction_[j] = direction * t.dry + t.drag + t.position;
    }
    right_ = drive_ - bias_ - friction_;
    for (int j = 0; j < n; ++j) {
      if (gears_[static_cast<std::size_t>(j)]) right_[j] = passed_Nm_[j] - bias_[j];
      else if (direction_[static_cast<std::size_t>(j)] == 0) right_[j] = 0;
    }
    link_qdd_ = factor_.solve(right_);
    load_ = link_mass_ * link_qdd_ + bias_;
  }
  qdd = link_qdd_;
  for (int j = 0; j < n; ++j)
    if (gears_[static_cast<std::size_t>(j)]) {
      const bool rests = direction_[static_cast<std::size_t>(j)] == 0;
      qdd[j] = rests ? 0 : (drive_[j] - passed_Nm_[j] - friction_[j]) / rotors_(j, j);
    }
}

// Accelerations of this instant; resting joints whose holding torque exceeds the breakaway level come loose, the most
// overloaded first, since each release changes the load on the others.
void Arm::Settle() {
  const int n = joints();
  FormDynamics(q_, qd_, ahead_, ahead_rate_);
  for (int releases = 0;; ++releases) {
    Accelerate(q_, qd_, current_, qdd_);
    int loose = -1, direction = 0;
    double most = 0;
    for (int j = 0; j < n; ++j) {
      if (direction_[static_cast<std::size_t>(j)] != 0) continue;
      // What friction and position torques hold.
      const double total = gears_[static_cast<std::size_t>(j)] ? drive_[j] - passed_Nm_[j]
                                                               : drive_[j] - bias_[j] - mass_.row(j).dot(link_qdd_);
      const double held = total - friction_[j];
      friction_[j] = total;
      const int push = held > 0 ? 1 : -1;
      const double excess = std::abs(held) - TorquesAt(j, push, q_, qd_, true).dry;
      if (excess <= most || brakes_ || stops_[static_cast<std::size_t>(j)] > 1 || releases > n) continue;
      loose = j, direction = push, most = excess;
    }
    if (loose < 0) return;
    direction_[static_cast<std::size_t>(loose)] = direction;
  }
}

void Arm::Remember(bool begin) {
  for (int j = 0; j < joints(); ++j)
    for (ActingEffect& e : effects_[static_cast<std::size_t>(j)]) {
      if (e.memory.empty()) continue;
      const JointState state = StateOf(j, direction_[static_cast<std::size_t>(j)], q_, qd_, e);
      if (begin || time_s_ < e.placed.from_s) e.placed.effect->Begin(state, e.memory);
      else e.placed.effect->Remember(state, e.memory);
    }
  for (ActingForce& f : forces_) f.force->Remember(links_->Place(q_ + ahead_, f.link, f.point, jacobian_));
}

// Explicit midpoint with the sign of every sliding joint held; the step ends early where the first speed passes zero.
void Arm::Advance(double duration_s) {
  std::fill(stops_.begin(), stops_.end(), 0);
  double left = duration_s;
  while (left > 0) {
    middle_q_ = q_ + 0.5 * left * qd_;
    middle_qd_ = qd_ + 0.5 * left * qdd_;
    middle_ahead_ = ahead_ + 0.5 * left * ahead_rate_;
    middle_ahead_rate_ = ahead_rate_ + 0.5 * left * (link_qdd_ - qdd_);
    FormDynamics(middle_q_, middle_qd_, middle_ahead_, middle_ahead_rate_);
    Accelerate(middle_q_, middle_qd_, CurrentAfter(0.5 * left), middle_qdd_);
    double step = left;
    int stopped = -1;
    for (int j = 0; j < joints(); ++j) {
      const double after = qd_[j] + left * middle_qdd_[j];
      if (after * direction_[static_cast<std::size_t>(j)] >= 0) continue;
      const double crossing = std::clamp(left * qd_[j] / (qd_[j] - after), 0.0, left);
      if (stopped < 0 || crossing < step) stopped = j, step = crossing;
    }
    q_ += step * (qd_ + 0.5 * step * middle_qdd_);
    qd_ += step * middle_qdd_;
    ahead_ += step * (ahead_rate_ + 0.5 * step * (link_qdd_ - middle_qdd_));
    ahead_rate_ += step * (link_qdd_ - middle_qdd_);
    current_ = CurrentAfter(step);
    command_ += step * slope_;
    if (stopped >= 0) {
      qd_[stopped] = 0;
      direction_[static_cast<std::size_t>(stopped)] = 0;
      ++stops_[static_cast<std::size_t>(stopped)];
    }
    left = stopped >= 0 ? left - step : 0;
    Remember();
    Settle();
  }
}

}  // namespace armcal::plant
