// drive - runs the ticks of the simulated drive and the background beside them.
#include "host_sim/machine/drive/simulated_drive.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "codegen/src/io/input_error.hpp"

namespace armcal::drive {
namespace {

constexpr int kSettleTicks = 240;  // virtual ticks that run on after an enable, an adoption or a motion
constexpr int kBrakeTicks = 40;    // current builds up before the brakes open
constexpr int kPoses = 200;        // of which the lightest decides the gains
constexpr double kMargin = 0.4;    // crossover x dead time, rad

// Encoders count modulo 2^32.
double CountsFrom(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

MotionLimits Limits(const codegen::Robot& robot) {
  const int n = robot.joints();
  MotionLimits limits{Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (int j = 0; j < n; ++j) {
    limits.speed_radps[j] = robot.joint[j].speed_limit_radps;
    limits.acceleration_radps2[j] = robot.joint[j].acceleration_limit_radps2;
  }
  return limits;
}

}  // namespace

Gains GainsOf(const codegen::Robot& robot, plant::Arm& arm) {
  if (!robot.coupling.empty())
    throw io::InputError(robot.path + ": coupling: the simulated drive's controller knows none");
  if (!robot.control.kp_Nmprad.empty()) return {robot.control.kp_Nmprad, robot.control.kd_Nmsprad};
  const int n = robot.joints();
  plant::Random random(1);
  Eigen::VectorXd least = Eigen::VectorXd::Constant(n, INFINITY);  // inertia of a joint while the others are free
  for (int k = 0; k < kPoses; ++k) {
    Eigen::VectorXd q(n);
    for (int j = 0; j < n; ++j)
      q[j] = random.Uniform(robot.joint[j].position_limit_rad[0], robot.joint[j].position_limit_rad[1]);
    least = least.cwiseMin(arm.Mass(q).inverse().diagonal().cwiseInverse());
  }
  const double crossover = kMargin / (2 * arm.tick_s() + arm.current_time_constant_s());
  Gains gains;
  for (int j = 0; j < n; ++j) {
    gains.kd_Nmsprad.push_back(crossover * least[j]);
    gains.kp_Nmprad.push_back(0.25 * crossover * crossover * least[j]);  // damping 1
  }
  return gains;
}

SimulatedDrive::SimulatedDrive(const DriveOptions& options, std::unique_ptr<Firmware> firmware)
    : options_(options),
      robot_(codegen::ReadRobot(options.robot)),
      arm_(plant::ReadScenario(options.scenario), options.robot),
      gains_(GainsOf(robot_, arm_)),
      player_(robot_.joints(), arm_.tick_s(), Limits(robot_)),
      firmware_(std::move(firmware)) {
  if (firmware_->joints() != robot_.joints() || firmware_->name() != robot_.name)
    throw io::InputError(robot_.path + ": robot " + robot_.name + ", expected that of the compiled firmware, " +
                         firmware_->name());
  if (!options.truth_log.empty() && !(truth_ = std::fopen(options.truth_log.c_str(), "wb")))
    throw io::InputError(options.truth_log + ": cannot be written");
  arm_.SetBrakes(true);
  arm_.Read(sensors_);
}

SimulatedDrive::~SimulatedDrive() {
  if (truth_) std::fclose(truth_);
}

void SimulatedDrive::Run(const std::atomic<bool>& quit, const std::function<void(const Firmware&)>& on_listen) {
  const std::string wrong = firmware_->Start(
      options_.storage, {options_.address, options_.port, options_.serial, options_.read_address, options_.read_port},
      player_);
  if (!wrong.empty()) throw io::InputError(wrong);
  on_listen(*firmware_);
  std::thread tick([&] { TickLoop(quit); });
  while (!quit.load()) firmware_->Serve(Background() ? 0 : 1);
  tick.join();
}

bool SimulatedDrive::Background() {
  const std::uint32_t generation = firmware_->generation();
  const bool busy = firmware_->Work(!options_.real_time);
  if (!busy && !player_.moving()) firmware_->Publish();  // what a reader finds after a motion is its last word
  if (firmware_->generation() != generation) grant_ = kSettleTicks;
  return busy;
}

void SimulatedDrive::TickLoop(const std::atomic<bool>& quit) {
  auto next = std::chrono::steady_clock::now();
  while (!quit.load()) {
    if (options_.real_time) {
      next +=
          std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(arm_.tick_s()));
      std::this_thread::sleep_until(next);
    } else if (!MayAdvance()) {
      std::this_thread::yield();
      if (!player_.moving())
        std::this_thread::sleep_for(std::chrono::microseconds(200));  // idle: leave the core to others
      continue;
    }
    Tick();
  }
}

bool SimulatedDrive::MayAdvance() {
  return firmware_->KeepsUp() && (player_.moving() || player_.command_pending() || grant_.load() > 0);
}

// One control tick. Context: tick.
void SimulatedDrive::Tick() {
  const int n = robot_.joints();
  const std::uint32_t tick = firmware_->tick();
  const client::PlayerState before = player_.state();
  Eigen::VectorXd q(n), qd(n);
  std::vector<AxisScale> axis;
  for (int j = 0; j < n; ++j) {
    axis.push_back(firmware_->axis(j));
    const double scale = axis.back().counts_to_rad;
    q[j] = scale * CountsFrom(axis.back().zero_counts, sensors_.counts[j]);
    qd[j] = have_previous_ ? scale * CountsFrom(previous_counts_[j], sensors_.counts[j]) / arm_.tick_s() : 0;
  }
  previous_counts_ = sensors_.counts;
  have_previous_ = true;
  // A tick ends where its set-point lies: the controller compares what was measured at its start with the set-point
  // before.
  const SetPoint reference =
      player_.enabled() ? last_set_ : SetPoint{q, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  // In virtual time a command waits until the arm has come to rest after the one before. So the same commands give the
  // same log, however long they take to arrive.
  const SetPoint& set = player_.Step(tick, q, options_.real_time || grant_.load() == 0);
  last_set_ = set;
  if (before != player_.state() && player_.reason() == client::StopReason::kTrackingError)
    firmware_->ReportTrackingError();
  Eigen::VectorXd tau_ff(n);
  firmware_->FeedForward(set.q.data(), set.qd.data(), set.qdd.data(), sensors_.temperature_degC.data(), tau_ff.data());

  const bool enabled = player_.enabled();
  firmware_->SetEnabled(enabled);
  enabled_ticks_ = enabled ? enabled_ticks_ + 1 : 0;
  arm_.SetBrakes(enabled_ticks_ < kBrakeTicks);
  std::vector<double> command(n, 0.0);
  for (int j = 0; j < n && enabled; ++j) {
    const double tau =
        gains_.kp_Nmprad[j] * (reference.q[j] - q[j]) + gains_.kd_Nmsprad[j] * (reference.qd[j] - qd[j]) + tau_ff[j];
    command[j] = tau / (firmware_->torque_scale(j) * axis[j].lsb_to_Nm) * robot_.joint[j].motor.current_A_per_lsb;
  }
  arm_.Step(command, sensors_);

  std::vector<Reading> readings;
  for (int j = 0; j < n; ++j)
    readings.push_back({sensors_.counts[j], sensors_.current_lsb[j], static_cast<float>(sensors_.temperature_degC[j]),
                        enabled && enabled_ticks_ > kBrakeTicks, static_cast<bool>(sensors_.saturated[j])});
  firmware_->Push(readings.data());
  if (truth_ && (player_.moving() || before == client::PlayerState::kPlaying)) WriteTruth(tick);
  if (!player_.moving()) grant_ = std::max(0, grant_.load() - 1);
  if (before != player_.state()) grant_ = kSettleTicks;
}

// What the current sensors would have read without noise, tick by tick: the floor that a perfect model leaves.
void SimulatedDrive::WriteTruth(std::uint32_t tick) {
  const Eigen::VectorXd tau = arm_.measured_torque_truth_Nm();
  std::fwrite(&tick, sizeof tick, 1, truth_);
  std::fwrite(tau.data(), sizeof(double), tau.size(), truth_);
  if (tick % 4096 == 0) std::fflush(truth_);
}

}  // namespace armcal::drive
