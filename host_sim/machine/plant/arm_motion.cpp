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

Arm::JointTorques Arm::TorquesAt(int joint, int direction, double q, double qd, bool breaking_loose) const {
  const std::size_t j = static_cast<std::size_t>(joint);
  const double coulomb = truth_.coulomb_Nm[j], viscous = truth_.viscous_Nmsprad[j] * qd;
  const JointState state{.q_rad = q,
                         .qd_radps = qd,
                         .direction = direction,
                         .load_Nm = load_[joint],
                         .temperature_degC = temperature_[joint],
                         .motor_angle_rad = robot_.joint[j].gear_ratio * q,
                         .coulomb_Nm = coulomb,
                         .viscous_Nm = viscous};
  JointTorques sum{breaking_loose ? scenario_.stick_ratio * coulomb : coulomb, viscous, 0, 0};
  double dry = 0;
  for (const PlacedJointEffect& placed : effects_[j]) {
    if (time_s_ < placed.from_s) continue;
    const double drag = placed.effect->Drag(state), position = placed.effect->Torque(state);
    dry += placed.effect->DryLevel(state);
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

void Arm::FormDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& qd) {
  links_->MassAndBias(q, qd, link_mass_, bias_);
  mass_ = link_mass_ + rotors_;
}

// M qdd = drive - bias - friction with resting joints constrained to qdd = 0: their rows and columns become unit ones.
// Tooth friction depends on the gear's load, which depends on qdd; starting from the last load, two rounds leave an
// error of mu^2 times the load's change in half an integration step.
void Arm::Accelerate(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& current,
                     Eigen::VectorXd& qdd) {
  const int n = joints();
  drive_ = JointTorque(current, truth_.torque_constant_NmpA);
  constrained_ = mass_;
  for (int j = 0; j < n; ++j) {
    if (direction_[static_cast<std::size_t>(j)] != 0) continue;
    constrained_.row(j).setZero();
    constrained_.col(j).setZero();
    constrained_(j, j) = 1;
  }
  factor_.compute(constrained_);
  for (int round = 0; round < 2; ++round) {
    for (int j = 0; j < n; ++j) {
      const int direction = direction_[static_cast<std::size_t>(j)];
      const JointTorques t = TorquesAt(j, direction, q[j], qd[j], false);
      friction_[j] = direction * t.dry + t.drag + t.position;
    }
    right_ = drive_ - bias_ - friction_;
    for (int j = 0; j < n; ++j)
      if (direction_[static_cast<std::size_t>(j)] == 0) right_[j] = 0;
    qdd = factor_.solve(right_);
    load_ = link_mass_ * qdd + bias_;
  }
}

// Accelerations of this instant; resting joints whose holding torque exceeds the breakaway level come loose, the most
// overloaded first, since each release changes the load on the others.
void Arm::Settle() {
  const int n = joints();
  FormDynamics(q_, qd_);
  for (int releases = 0;; ++releases) {
    Accelerate(q_, qd_, current_, qdd_);
    int loose = -1, direction = 0;
    double most = 0;
    for (int j = 0; j < n; ++j) {
      if (direction_[static_cast<std::size_t>(j)] != 0) continue;
      const double total = drive_[j] - bias_[j] - mass_.row(j).dot(qdd_);  // what friction and position torques hold
      const double held = total - friction_[j];
      friction_[j] = total;
      const int push = held > 0 ? 1 : -1;
      const double excess = std::abs(held) - TorquesAt(j, push, q_[j], 0, true).dry;
      if (excess <= most || brakes_ || stops_[static_cast<std::size_t>(j)] > 1 || releases > n) continue;
      loose = j, direction = push, most = excess;
    }
    if (loose < 0) return;
    direction_[static_cast<std::size_t>(loose)] = direction;
  }
}

// Explicit midpoint with the sign of every sliding joint held; the step ends early where the first speed passes zero.
void Arm::Advance(double duration_s) {
  std::fill(stops_.begin(), stops_.end(), 0);
  double left = duration_s;
  while (left > 0) {
    middle_q_ = q_ + 0.5 * left * qd_;
    middle_qd_ = qd_ + 0.5 * left * qdd_;
    FormDynamics(middle_q_, middle_qd_);
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
    current_ = CurrentAfter(step);
    command_ += step * slope_;
    if (stopped >= 0) {
      qd_[stopped] = 0;
      direction_[static_cast<std::size_t>(stopped)] = 0;
      ++stops_[static_cast<std::size_t>(stopped)];
    }
    left = stopped >= 0 ? left - step : 0;
    Settle();
  }
}

}  // namespace armcal::plant
