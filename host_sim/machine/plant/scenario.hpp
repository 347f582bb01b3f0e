// plant - holds what a scenario file says: which arm, how its true parameters are drawn, which effects are undeclared.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/machine/plant/dynamics.hpp"
#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/link_forces.hpp"
#include "host_sim/machine/plant/reading_effects.hpp"
#include "host_sim/machine/plant/transmission.hpp"
#include "host_sim/machine/plant/truth.hpp"

namespace armcal::plant {

// One undeclared effect, for a report. kind: as in the scenario. joint: a number, or two as "5-6", or "all", "flange",
// "base".
struct Undeclared {
  std::string kind;
  std::string joint;
};

struct PlacedJointEffect {
  std::string kind;
  int joint = 0;  // 0-based
  std::shared_ptr<const JointEffect> effect;
  double from_s = 0;      // it is not there before
  bool reaction = false;  // what an effect of another joint does here; a report leaves it out
};

// A force on a link.
struct PlacedForce {
  std::string kind;
  int link = -1;  // 0-based; -1: the last one
  std::shared_ptr<const LinkForce> force;
  double from_s = 0;
};

// What the torque's reading undergoes.
struct PlacedReading {
  std::string kind;
  int axis = -1;  // 0-based; -1: all
  std::shared_ptr<const ReadingEffect> effect;
  double from_s = 0;
};

// A wheel that turns with a joint's motor.
struct Flywheel {
  int joint = 0;
  double inertia_kgm2 = 0;  // on the joint's side
};

// A body clamped to the flange from one time to another.
struct PayloadStep {
  Body body;  // in flange axes
  double from_s = 0;
  double until_s = 0;  // infinity: it stays
};

// Joint temperature by friction power P: T' = (ambient + rise P - T) / time constant. One entry a joint, or one for
// all.
struct Thermal {
  double ambient_degC = 25;
  std::vector<double> start_degC{25};
  std::vector<double> rise_KpW{0.02};
  std::vector<double> time_constant_s{1200};
};

struct Scenario {
  std::string path, title, robot;  // robot: empty: any
  std::uint64_t truth_seed = 1, noise_seed = 1;
  Spread spread;
  Thermal thermal;
  double stick_ratio = 1;  // breakaway level / Coulomb level
  double current_time_constant_s = 0.001;
  bool command_ramps = false;            // from one tick's current command to the next; else it steps
  int substeps = 4;                      // integration steps a tick
  double torque_noise_scale = 1;         // x the robot file's torque noise
  double temperature_noise_degC = 0.05;  // standard deviation of a reading
  std::vector<double> start_rad;  // empty: zero or the limit next to it, or near that where the motors can hold the arm
  std::optional<KDL::Frame> flange;  // instead of the robot file's tool frame
  std::vector<PlacedJointEffect> joint_effects;
  std::vector<Transmission> transmissions;
  std::vector<Flywheel> flywheels;
  std::vector<PlacedForce> forces;
  std::vector<PlacedReading> readings;
  std::optional<PayloadStep> payload;
  double tilt_roll_rad = 0, tilt_pitch_rad = 0;  // of the true base against the declared one

  bool tilted() const { return tilt_roll_rad != 0 || tilt_pitch_rad != 0; }
  // Kind and joint of everything that the robot file does not know of: joint effects in the file's order, then
  // transmissions, rotors, readings, forces, payload and base.
  std::vector<Undeclared> undeclared() const;
};

// Throws io::InputError (file, key, what was expected); unknown keys are refused. Whether joint numbers and list
// lengths fit the robot is judged by Arm, which knows it.
Scenario ReadScenario(const std::string& path);
// Throws io::InputError if the scenario is of another robot than the one in robot_path.
void RequireRobot(const Scenario& scenario, const std::string& robot, const std::string& robot_path);

}  // namespace armcal::plant
