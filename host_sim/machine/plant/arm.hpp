// plant - simulates the arm as it really is: true bodies, true stiction, motors and sensors.
//
// Motion:  C^T tau_motor = M(q) qdd + h(q, qd) + friction + undeclared torque, M with rotors (gyroscopic part
// neglected). Friction is Coulomb + viscous with true stiction: a resting joint is a constraint until the torque needed
// to hold it exceeds its breakaway level, and a moving joint whose speed passes zero stops first. Where a joint is
// elastic or has play, motor and link are two masses: friction, rotor and encoder are the motor's, and q is the
// motor's. Motor current follows its command by a first-order lag (exact between ticks); commands are held over a tick,
// or reached at its end by a ramp, and cut to the current limit, torque limit / (gear ratio x nominal torque constant).
// Timing: Step holds a command over one tick; at the tick's END encoder, current and temperature are read at the same
// instant. The current is not averaged over the tick, so reading and motion (q, qd, qdd) belong together exactly.
// Whoever averages counts and current over the same ticks keeps that if commands ramp. If they are held, the current of
// a tick is a curve whose mean leads the mean of its ends: by 0.08 ms at 1 kHz and a lag of 1 ms.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "host_sim/machine/plant/dynamics.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/machine/plant/scenario.hpp"
#include "host_sim/machine/plant/truth.hpp"

namespace armcal::plant {

// What the drive's hardware gives at the end of a tick. Shapes: one entry a motor axis.
struct Sensors {
  std::vector<std::int32_t> counts;       // motor encoder, wraps
  std::vector<std::int16_t> current_lsb;  // torque-producing current
  std::vector<double> temperature_degC;
  std::vector<bool> saturated;  // the command or the reading stood at its limit during the tick
};

// Motor position in joint units -> counts: nearest step, wrapping like a 32-bit register.
inline std::int32_t EncoderCounts(double position_rad, double gear_ratio, double counts_per_turn,
                                  long long zero_counts) {
  const double counts = position_rad * gear_ratio * counts_per_turn / (2 * std::numbers::pi);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(std::llround(counts) + zero_counts));
}

// Current -> LSB: nearest step, held at the ends of a 16-bit converter.
inline std::int16_t CurrentLsb(double current_A, double A_per_lsb) {
  return static_cast<std::int16_t>(std::llround(std::clamp(current_A / A_per_lsb, -32767.0, 32767.0)));
}

// Not thread-safe. Shapes [n]; joint side, rad (m), N m (N) unless a name says otherwise.
class Arm {
 public:
  // Starts at rest in the scenario's start pose, without current, brakes open. Throws io::InputError when the scenario
  // is for another robot or does not fit it.
  Arm(const Scenario& scenario, const std::string& robot_path);

  // Puts the arm to rest in another pose, without current.
  void Place(std::span<const double> q);
  // Closed brakes hold every joint whatever the torque (moving joints stop at once). Current still flows.
  void SetBrakes(bool closed);
  // One tick with current_command_A [n] (motor side, amperes) held; then reads the sensors. Throws
  // std::invalid_argument for another size or a number that is not finite.
  void Step(std::span<const double> current_command_A, Sensors& out);
  // The sensors now (with fresh noise); Step calls it.
  void Read(Sensors& out);

  int joints() const { return robot_.joints(); }
  double tick_s() const { return tick_s_; }
  double current_time_constant_s() const { return scenario_.current_time_constant_s; }
  // The true inertia in a pose, rotors included, [n x n]. The arm stays where it is.
  Eigen::MatrixXd Mass(const Eigen::VectorXd& q);
  double time_s() const { return time_s_; }
  const RobotFile& robot() const { return robot_; }
  const Truth& truth() const { return truth_; }

  // The truth at this instant.
  const Eigen::VectorXd& q() const { return q_; }               // of the motors, where a joint is elastic or has play
  const Eigen::VectorXd& link_ahead() const { return ahead_; }  // by which the link is ahead of its motor there
  const Eigen::VectorXd& qd() const { return qd_; }
  const Eigen::VectorXd& qdd() const { return qdd_; }
  const Eigen::VectorXd& temperature_degC() const { return temperature_; }
  bool at_rest(int joint) const { return direction_[static_cast<std::size_t>(joint)] == 0; }
  // Torque that the motors really give, in joint coordinates.
  Eigen::VectorXd torque_Nm() const { return JointTorque(current_, truth_.torque_constant_NmpA); }
  // What the current sensor of this instant would read without noise and steps, as joint torque by NOMINAL constants.
  Eigen::VectorXd measured_torque_truth_Nm() const { return JointTorque(reading_, nominal_constant_); }
  // Torque that Coulomb and viscous friction and joint effects take; at rest: what friction holds plus position
  // torques.
  const Eigen::VectorXd& friction_torque_Nm() const { return friction_; }
  // Torque of everything undeclared, payload and base tilt included; friction-like effects count while moving only.
  Eigen::VectorXd undeclared_torque_Nm();

 private:
  // The torque of one joint at one instant, split by what it does.
  struct JointTorques {
    double dry = 0;         // level of dry friction against the direction of motion, not below 0
    double drag = 0;        // viscous friction and drag
    double position = 0;    // torque that is no friction
    double undeclared = 0;  // the share of effects, signed
  };
  struct ActingEffect {
    PlacedJointEffect placed;
    std::vector<double> memory;
  };
  struct ActingForce {
    int link;
    KDL::Vector point;
    std::unique_ptr<LinkForce> force;
    double from_s;
  };
  struct ActingReading {
    std::unique_ptr<ReadingEffect> effect;
    double from_s;
  };

  void PlaceEffects();
  JointState StateOf(int joint, int direction, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                     const ActingEffect& effect) const;
  JointTorques TorquesAt(int joint, int direction, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                         bool breaking_loose) const;
  void FormDynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& ahead,
                    const Eigen::VectorXd& ahead_rate);
  void Accelerate(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& current,
                  Eigen::VectorXd& qdd);
  void Settle();
  void Remember(bool begin = false);  // begin: nothing happened before
  void TakeReading();
  double HeldByConverter(std::size_t axis, double current_A) const;
  void Advance(double duration_s);
  void Warm();
  bool ChoosePayload();  // true when the load at the flange changed
  Eigen::VectorXd JointTorque(const Eigen::VectorXd& current, const std::vector<double>& constant) const;
  Eigen::VectorXd CurrentAfter(double duration_s) const;

  Scenario scenario_;
  RobotFile robot_;
  Truth truth_;
  Random noise_;
  Dynamics bare_, laden_, declared_;  // laden: with the payload; declared: without payload and tilt
  Dynamics* links_ = &bare_;
  std::vector<std::vector<ActingEffect>> effects_;    // by joint
  std::vector<std::vector<ActingReading>> channels_;  // by motor axis
  std::vector<ActingForce> forces_;
  std::vector<const Transmission*> gears_;  // by joint; nullptr: stiff
  Eigen::VectorXd flywheels_;               // by joint, kg m^2
  std::vector<double> nominal_constant_;
  Eigen::MatrixXd rotors_;  // C^T diag(N^2 J) C
  Eigen::VectorXd rise_KpW_, warming_time_s_;
  double tick_s_ = 0.001, time_s_ = 0;
  long long ticks_ = 0;
  bool brakes_ = false;

  // q_ is where the motors stand, in joint units. Behind an elastic gear the link is ahead_ of it.
  Eigen::VectorXd q_, qd_, qdd_, ahead_, ahead_rate_, current_, command_, slope_, temperature_, friction_, load_;
  Eigen::VectorXd reading_;     // current as the reading has it, without noise
  std::vector<int> direction_;  // of a moving joint, -1 or +1; 0: the joint rests
  std::vector<int> stops_;      // of this integration step; a joint that stopped twice rests until its end
  std::vector<bool> cut_;       // command was cut in this tick

  // Work space of the equations of motion.
  Eigen::MatrixXd link_mass_, mass_, constrained_;
  Eigen::MatrixXd jacobian_;
  Eigen::VectorXd bias_, drive_, right_, middle_q_, middle_qd_, middle_qdd_, middle_ahead_, middle_ahead_rate_;
  Eigen::VectorXd link_q_, link_qd_, link_qdd_, passed_Nm_, outside_Nm_, motor_angle_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace armcal::plant
