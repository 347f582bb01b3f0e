// plant - runs one tick of the true arm: command, motion, heat, sensors. The equations are in arm_motion.cpp.
#include "host_sim/machine/plant/arm.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "codegen/src/io/input_error.hpp"

namespace armcal::plant {
namespace {

KDL::Vector TiltedGravity(const RobotFile& robot, const Scenario& scenario) {
  return KDL::Rotation::RPY(scenario.tilt_roll_rad, scenario.tilt_pitch_rad, 0).Inverse(robot.gravity_mps2);
}

std::optional<AttachedBody> PayloadBody(const RobotFile& robot, const Scenario& scenario) {
  if (!scenario.payload) return std::nullopt;
  return AttachedBody{scenario.payload->body, scenario.flange.value_or(robot.tool_frame)};
}

// A deflection changes gravity's torque, which changes the deflection: each round leaves some hundredths of the error.
constexpr int kHangingRounds = 12;

// A list of one value stands for all joints.
Eigen::VectorXd PerJoint(const std::vector<double>& values, const Scenario& scenario, const std::string& key, int n) {
  if (values.size() == 1) return Eigen::VectorXd::Constant(n, values[0]);
  if (values.size() != static_cast<std::size_t>(n))
    throw io::InputError(scenario.path + ": " + key + ": expected " + std::to_string(n) + " numbers, one a joint");
  return Eigen::Map<const Eigen::VectorXd>(values.data(), n);
}

// Zero, or the limit next to it. An arm that its motors cannot hold there starts at the pose nearest to that, of many
// poses drawn, at which they can. If there is none, the brakes must hold it.
Eigen::VectorXd RestingPose(const RobotFile& robot, Dynamics& dynamics) {
  constexpr int kPoses = 2000;
  constexpr double kShare = 0.6;              // of the torque limit: the controller needs the rest
  constexpr double kWide = std::numbers::pi;  // rad, m; for joints without limits
  const int n = robot.joints();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n);
  const auto held = [&](const Eigen::VectorXd& q) {
    const Eigen::VectorXd torque = dynamics.Torque(q, rest, rest);
    for (int j = 0; j < n; ++j)
      if (std::abs(torque[j]) > kShare * robot.joint[static_cast<std::size_t>(j)].torque_limit_Nm) return false;
    return true;
  };
  Eigen::VectorXd zero(n), q(n);
  const auto each = [&](Eigen::VectorXd& to, auto value) {
    for (int j = 0; j < n; ++j) {
      const JointData& joint = robot.joint[static_cast<std::size_t>(j)];
      to[j] = value(joint.lowest_rad, joint.highest_rad);
    }
  };
  each(zero, [](double low, double high) { return std::clamp(0.0, low, high); });
  if (held(zero)) return zero;
  Random random(1);
  Eigen::VectorXd best = zero;
  double least = INFINITY;
  for (int k = 0; k < kPoses; ++k) {
    each(q, [&](double low, double high) { return random.Uniform(std::max(low, -kWide), std::min(high, kWide)); });
    if (const double far = (q - zero).norm(); far < least && held(q)) best = q, least = far;
  }
  return best;
}

}  // namespace

Arm::Arm(const Scenario& scenario, const std::string& robot_path)
    : scenario_(scenario),
      robot_(ReadRobotFile(robot_path)),
      truth_(DrawTruth(robot_, scenario.spread, scenario.truth_seed)),
      noise_(scenario.noise_seed),
      bare_(robot_, truth_.body, TiltedGravity(robot_, scenario)),
      laden_(robot_, truth_.body, TiltedGravity(robot_, scenario), PayloadBody(robot_, scenario)),
      declared_(robot_, truth_.body, robot_.gravity_mps2),
      effects_(robot_.joint.size()),
      channels_(robot_.joint.size()),
      gears_(robot_.joint.size(), nullptr),
      tick_s_(1 / robot_.tick_rate_Hz),
      direction_(robot_.joint.size(), 0),
      stops_(robot_.joint.size(), 0),
      cut_(robot_.joint.size(), false) {
  const int n = joints();
  RequireRobot(scenario, robot_.name, robot_path);
  Eigen::VectorXd rotor(n);
  for (int j = 0; j < n; ++j) {
    const JointData& joint = robot_.joint[static_cast<std::size_t>(j)];
    rotor[j] = joint.gear_ratio * joint.gear_ratio * truth_.rotor_inertia_kgm2[static_cast<std::size_t>(j)];
    nominal_constant_.push_back(joint.torque_constant_NmpA);
  }
  rotors_ = robot_.coupling.transpose() * rotor.asDiagonal() * robot_.coupling;
  PlaceEffects();
  temperature_ = PerJoint(scenario.thermal.start_degC, scenario, "thermal.start_degC", n);
  rise_KpW_ = PerJoint(scenario.thermal.rise_KpW, scenario, "thermal.rise_KpW", n);
  warming_time_s_ = PerJoint(scenario.thermal.time_constant_s, scenario, "thermal.time_constant_s", n);
  friction_ = load_ = command_ = slope_ = passed_Nm_ = outside_Nm_ = motor_angle_ = Eigen::VectorXd::Zero(n);
  const Eigen::VectorXd start = scenario.start_rad.empty() ? RestingPose(robot_, declared_)
                                                           : PerJoint(scenario.start_rad, scenario, "start_rad", n);
  ChoosePayload();
  Place({start.data(), static_cast<std::size_t>(n)});
}

void Arm::PlaceEffects() {
  const int n = joints();
  const auto fits = [&](int joint) {
    if (joint >= n)
      throw io::InputError(scenario_.path + ": effect: joint: expected a joint from 1 to " + std::to_string(n));
    return static_cast<std::size_t>(joint);
  };
  for (const PlacedJointEffect& placed : scenario_.joint_effects) {
    fits(placed.effect->other_joint() < 0 ? 0 : placed.effect->other_joint());
    effects_[fits(placed.joint)].push_back({placed, std::vector<double>(placed.effect->memory())});
  }
  for (const PlacedReading& placed : scenario_.readings)
    for (int j = 0; j < n; ++j)
      if (placed.axis < 0 || fits(placed.axis) == static_cast<std::size_t>(j))
        channels_[static_cast<std::size_t>(j)].push_back({placed.effect->Copy(), placed.from_s});
  for (const PlacedForce& placed : scenario_.forces) {
    const bool flange = placed.force->at_flange();
    const KDL::Vector point = flange ? scenario_.flange.value_or(robot_.tool_frame).p : placed.force->point;
    forces_.push_back(
        {flange ? n - 1 : static_cast<int>(fits(placed.link)), point, placed.force->Copy(), placed.from_s});
  }
  flywheels_ = Eigen::VectorXd::Zero(n);
  for (const Flywheel& wheel : scenario_.flywheels)
    flywheels_[static_cast<Eigen::Index>(fits(wheel.joint))] += wheel.inertia_kgm2;
  rotors_.diagonal() += flywheels_;
  for (const Transmission& gear : scenario_.transmissions) {
    gears_[fits(gear.joint)] = &gear;
    const Eigen::VectorXd row = rotors_.row(gear.joint);
    if (!(row[gear.joint] > 0) || row.cwiseAbs().sum() > row[gear.joint])
      throw io::InputError(scenario_.path + ": effect: " + gear.kind +
                           ": expected a joint whose own motor has a rotor");
    const double mass = Mass(Eigen::VectorXd::Zero(n))(gear.joint, gear.joint) - row[gear.joint];
    const double step = tick_s_ / scenario_.substeps;
    if (gear.stiffness_Nmprad * (1 / mass + 1 / row[gear.joint]) * step * step > 0.5)
      throw io::InputError(scenario_.path + ": effect: stiffness_Nmprad: expected a spring that " +
                           std::to_string(scenario_.substeps) + " substeps can follow");
  }
}

void Arm::Place(std::span<const double> q) {
  const int n = joints();
  if (q.size() != static_cast<std::size_t>(n)) throw std::invalid_argument("plant::Arm::Place: one number a joint");
  q_ = Eigen::Map<const Eigen::VectorXd>(q.data(), n);
  qd_ = qdd_ = current_ = reading_ = ahead_ = ahead_rate_ = Eigen::VectorXd::Zero(n);
  std::fill(direction_.begin(), direction_.end(), 0);
  for (int round = 0; round < kHangingRounds && !scenario_.transmissions.empty(); ++round) {
    FormDynamics(q_, qd_, ahead_, ahead_rate_);
    for (const Transmission& gear : scenario_.transmissions) ahead_[gear.joint] = gear.Hanging(bias_[gear.joint]);
  }
  FormDynamics(q_, qd_, ahead_, ahead_rate_);
  Remember(true);
  Settle();
}

void Arm::SetBrakes(bool closed) {
  brakes_ = closed;
  if (closed) {
    qd_.setZero();
    std::fill(direction_.begin(), direction_.end(), 0);
  }
  Settle();
}

void Arm::Step(std::span<const double> current_command_A, Sensors& out) {
  const int n = joints();
  if (current_command_A.size() != static_cast<std::size_t>(n))
    throw std::invalid_argument("plant::Arm::Step: one current a joint");
  Eigen::VectorXd target(n);
  for (int j = 0; j < n; ++j) {
    const JointData& joint = robot_.joint[static_cast<std::size_t>(j)];
    const double wanted = current_command_A[static_cast<std::size_t>(j)];
    if (!std::isfinite(wanted)) throw std::invalid_argument("plant::Arm::Step: finite currents");
    const double limit = joint.torque_limit_Nm / (std::abs(joint.gear_ratio) * joint.torque_constant_NmpA);
    target[j] = std::clamp(wanted, -limit, limit);
    cut_[static_cast<std::size_t>(j)] = target[j] != wanted;
  }
  if (scenario_.command_ramps) slope_ = (target - command_) / tick_s_;
  else command_ = target;
  for (int s = 0; s < scenario_.substeps; ++s) Advance(tick_s_ / scenario_.substeps);
  command_ = target;
  Warm();
  time_s_ = static_cast<double>(++ticks_) * tick_s_;
  TakeReading();
  if (ChoosePayload()) Settle();
  Read(out);
}

void Arm::Read(Sensors& out) {
  const std::size_t n = robot_.joint.size();
  out.counts.resize(n), out.current_lsb.resize(n), out.temperature_degC.resize(n), out.saturated.resize(n);
  const Eigen::VectorXd motor = robot_.coupling * q_;
  for (std::size_t j = 0; j < n; ++j) {
    const JointData& joint = robot_.joint[j];
    const Eigen::Index i = static_cast<Eigen::Index>(j);
    // The file gives noise as joint torque by nominal constants; the sensor makes it as current.
    const double sigma_A = scenario_.torque_noise_scale * joint.torque_noise_Nm /
                           (std::abs(joint.gear_ratio) * joint.torque_constant_NmpA);
    out.counts[j] = EncoderCounts(motor[i], joint.gear_ratio, joint.counts_per_turn, joint.zero_counts);
    out.current_lsb[j] =
        CurrentLsb(HeldByConverter(j, reading_[i] + sigma_A * noise_.Normal()), joint.current_A_per_lsb);
    out.temperature_degC[j] = temperature_[i] + scenario_.temperature_noise_degC * noise_.Normal();
    out.saturated[j] = cut_[j] || std::abs(static_cast<int>(out.current_lsb[j])) == 32767;
  }
}

double Arm::HeldByConverter(std::size_t axis, double current_A) const {
  const double Nm_per_A = std::abs(robot_.joint[axis].gear_ratio) * nominal_constant_[axis];
  for (const ActingReading& reading : channels_[axis]) {
    const double limit = reading.effect->limit_Nm() / Nm_per_A;
    if (time_s_ >= reading.from_s) current_A = std::clamp(current_A, -limit, limit);
  }
  return current_A;
}

void Arm::TakeReading() {
  reading_ = current_;
  for (std::size_t j = 0; j < channels_.size(); ++j) {
    if (channels_[j].empty()) continue;
    const auto i = static_cast<Eigen::Index>(j);
    const double Nm_per_A = robot_.joint[j].gear_ratio * nominal_constant_[j];
    double torque = current_[i] * Nm_per_A;
    for (const ActingReading& reading : channels_[j])
      if (time_s_ >= reading.from_s)
        torque = reading.effect->Pass(torque, tick_s_, time_s_ - reading.from_s, robot_.joint[j].gear_ratio * q_[i]);
    reading_[i] = HeldByConverter(j, torque / Nm_per_A);
  }
}

Eigen::VectorXd Arm::undeclared_torque_Nm() {
  Eigen::VectorXd torque = links_->Torque(q_ + ahead_, qd_ + ahead_rate_, link_qdd_) - declared_.Torque(q_, qd_, qdd_);
  for (int j = 0; j < joints(); ++j)
    torque[j] += TorquesAt(j, direction_[static_cast<std::size_t>(j)], q_, qd_, false).undeclared;
  torque += flywheels_.cwiseProduct(qdd_);
  if (!forces_.empty()) torque += outside_Nm_;
  const bool reads_true = std::all_of(channels_.begin(), channels_.end(), [](const auto& c) { return c.empty(); });
  if (!reads_true) torque += JointTorque(reading_ - current_, nominal_constant_);
  return torque;
}

Eigen::VectorXd Arm::JointTorque(const Eigen::VectorXd& current, const std::vector<double>& constant) const {
  Eigen::VectorXd motor(joints());
  for (int j = 0; j < joints(); ++j)
    motor[j] =
        robot_.joint[static_cast<std::size_t>(j)].gear_ratio * constant[static_cast<std::size_t>(j)] * current[j];
  return robot_.coupling.transpose() * motor;
}

void Arm::Warm() {
  for (int j = 0; j < joints(); ++j) {
    const std::size_t k = static_cast<std::size_t>(j);
    const JointTorques t = TorquesAt(j, direction_[k], q_, qd_, false);
    const double power_W = (direction_[k] * t.dry + t.drag) * qd_[j];
    const double target = scenario_.thermal.ambient_degC + rise_KpW_[j] * power_W;
    temperature_[j] += (target - temperature_[j]) * tick_s_ / warming_time_s_[j];
  }
}

bool Arm::ChoosePayload() {
  const bool on = scenario_.payload && time_s_ >= scenario_.payload->from_s && time_s_ < scenario_.payload->until_s;
  Dynamics* before = std::exchange(links_, on ? &laden_ : &bare_);
  return links_ != before;
}

}  // namespace armcal::plant
