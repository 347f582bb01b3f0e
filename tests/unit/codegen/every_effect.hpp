// tests - er20_like with every record that a model can hold: what is compiled to check the emitted C++ of each.
#pragma once

#include "codegen/src/generator/model.hpp"

namespace armcal::tests {

// Laws that replace the friction law go one to a joint, all others to joint 2, joints 5-6 or the arm.
inline codegen::Model EveryEffect() {
  const auto records = codegen::ReadCatalogue("codegen/effects");
  codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  robot.name = "every_effect";
  robot.effect.clear();
  int free_joint = 0;
  for (const auto& [name, record] : records) {
    if (record.friction_law || !record.on_target) continue;
    codegen::EffectUse use;
    use.effect = name;
    if (!record.replaces.empty()) use.joints = {free_joint++};
    else if (record.scope == codegen::EffectScope::kJoint) use.joints = {1};
    else if (record.scope == codegen::EffectScope::kPair) use.joints = {4, 5};
    if (name == "backlash") use.nonlinear["gap"] = 5e-3;  // many float steps of a position wide
    robot.effect.push_back(use);
  }
  return {robot, records};
}

}  // namespace armcal::tests
