// plant - finds the effect of one joint by its kind.
#include "host_sim/machine/plant/joint_effects.hpp"

namespace armcal::plant {
namespace {

constexpr int kMostJoints = 16;  // an upper bound for any robot; Arm checks the number of this robot

}  // namespace

const JointEffectReaders& AllJointEffects() {
  static const JointEffectReaders readers = [] {
    JointEffectReaders all = FrictionReaders();
    all.merge(BristleReaders());
    all.merge(TorqueReaders());
    all.merge(PairReaders());
    return all;
  }();
  return readers;
}

int ReadJointNumber(const io::TomlReader& keys, const std::string& key) {
  return static_cast<int>(keys.Integer(key, 1, kMostJoints)) - 1;
}

int ReadOtherJoint(const io::TomlReader& keys, int joint) {
  const int other = ReadJointNumber(keys, "of_joint");
  if (other == joint) keys.Fail("of_joint", "another joint than joint");
  return other;
}

std::unique_ptr<const JointEffect> ReadJointEffect(const std::string& kind, const io::TomlReader& keys, int joint) {
  const auto reader = AllJointEffects().find(kind);
  if (reader == AllJointEffects().end()) {
    std::string kinds;
    for (const auto& [name, of] : AllJointEffects()) kinds += (kinds.empty() ? "" : ", ") + name;
    keys.Fail("kind", "one of: " + kinds);
  }
  return reader->second(keys, joint);
}

}  // namespace armcal::plant
