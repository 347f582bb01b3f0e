// plant - describes what happens in a joint beyond Coulomb and viscous friction.
//
// On purpose these are not the forms that the effect records use: a record has to find the physics, not itself.
// Rotary units; for a prismatic joint read N, m, m/s.
#pragma once

#include <memory>
#include <string>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

// The joint at one instant.
struct JointState {
  double q_rad = 0;
  double qd_radps = 0;
  int direction = 0;   // of motion, or in which a resting joint is being pushed: -1, +1
  double load_Nm = 0;  // torque that the gear hands to the link (rigid-body torque, no rotor, no friction)
  double temperature_degC = 0;
  double motor_angle_rad = 0;  // gear ratio x joint angle
  double coulomb_Nm = 0;       // the joint's own (true) Coulomb level
  double viscous_Nm = 0;       // ... and viscous torque at this speed, at the reference temperature
};

// One effect in one joint. All values in N m, signed like the motor's joint torque: what the motor must give more.
class JointEffect {
 public:
  virtual ~JointEffect() = default;

  // Added to the dry friction level that opposes `direction`; at rest also to the level that breaks the joint loose.
  virtual double DryLevel(const JointState&) const { return 0; }
  // Added drag; zero at zero speed. Heats the joint, as dry friction does.
  virtual double Drag(const JointState&) const { return 0; }
  // Torque that depends on position only; acts at rest, too, and heats nothing.
  virtual double Torque(const JointState&) const { return 0; }
};

// kind -> effect. Reads the effect's own keys (documented in host_sim/scenarios/README.md); the caller has read `kind`
// and `joint` and calls keys.Finish(). Throws io::InputError for an unknown kind or a bad value.
std::unique_ptr<const JointEffect> ReadJointEffect(const std::string& kind, const io::TomlReader& keys);

// The kinds that ReadJointEffect knows, for messages: "stribeck, load_friction, ...".
std::string JointEffectKinds();

}  // namespace armcal::plant
