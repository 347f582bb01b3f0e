// plant - describes what happens in a joint beyond Coulomb and viscous friction.
//
// On purpose these are not the forms that the effect records use: a record has to find the physics, not itself. A law
// that is its own definition, as a product of two speeds, is written here anew.
// Rotary units; for a prismatic joint read N, m, m/s.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
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
  double motor_angle_rad = 0;        // gear ratio x joint angle
  double coulomb_Nm = 0;             // the joint's own (true) Coulomb level
  double viscous_Nm = 0;             // ... and viscous torque at this speed, at the reference temperature
  double since_s = 0;                // time since the effect is there
  std::span<const double> memory{};  // the effect's own; see JointEffect::memory
  std::span<const double> all_q{}, all_qd{}, all_load{}, all_motor{};  // of all joints; motor: gear ratio x joint angle
};

// One effect in one joint. All values in N m, signed like the motor's joint torque: what the motor must give more.
class JointEffect {
 public:
  virtual ~JointEffect() = default;

  // Added to the dry friction level that opposes `direction`; at rest also to the level that breaks the joint loose.
  virtual double DryLevel(const JointState&) const { return 0; }
  // Added drag: friction that is no constraint at rest. Heats the joint, as dry friction does.
  virtual double Drag(const JointState&) const { return 0; }
  // Torque that is no friction of this joint; acts at rest, too, and heats nothing.
  virtual double Torque(const JointState&) const { return 0; }

  // How many numbers the effect remembers of the past. They hold what Remember left after the last integration step;
  // Begin fills them while the effect is not there yet.
  virtual std::size_t memory() const { return 0; }
  virtual void Begin(const JointState&, std::span<double>) const {}
  virtual void Remember(const JointState&, std::span<double>) const {}

  // The other joint that the effect reads, from 0; -1: none.
  virtual int other_joint() const { return -1; }
  // What the same cause does in that other joint; nullptr: nothing.
  virtual std::unique_ptr<const JointEffect> AtTheOtherJoint() const { return nullptr; }
};

// The kinds of one file, and what makes an effect of each: (keys, joint from 0) -> effect.
using JointEffectReader = std::function<std::unique_ptr<const JointEffect>(const io::TomlReader& keys, int joint)>;
using JointEffectReaders = std::map<std::string, JointEffectReader>;
JointEffectReaders FrictionReaders();  // friction_effects.cpp: speed, load, temperature, time, position
JointEffectReaders BristleReaders();   // bristle_effects.cpp: friction that remembers where the joint has been
JointEffectReaders TorqueReaders();    // torque_effects.cpp: torque that is no friction
JointEffectReaders PairReaders();      // pair_effects.cpp: what another joint causes

template <class Effect>
JointEffectReader ReaderOf() {
  return [](const io::TomlReader& keys, int) { return std::make_unique<const Effect>(keys); };
}

// A key with the number of a joint, from 0. Whether the robot has it is judged by Arm.
int ReadJointNumber(const io::TomlReader& keys, const std::string& key);
// The key `of_joint`, from 0.
int ReadOtherJoint(const io::TomlReader& keys, int joint);

// kind -> effect. Reads the effect's own keys (documented in host_sim/scenarios/README.md); the caller has read `kind`
// and `joint` and calls keys.Finish(). Throws io::InputError for an unknown kind or a bad value.
std::unique_ptr<const JointEffect> ReadJointEffect(const std::string& kind, const io::TomlReader& keys, int joint = 0);

// The kinds that ReadJointEffect knows.
const JointEffectReaders& AllJointEffects();

}  // namespace armcal::plant
