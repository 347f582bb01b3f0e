// tests - er20_like with the Stribeck law, or with a friction that has memory, on every joint, into a folder each, in
// this order.
#include "codegen/src/generator/emit.hpp"

int main(int, char** folder) {
  for (const std::string effect : {"stribeck", "presliding_dahl"}) {
    armcal::codegen::Robot robot = armcal::codegen::ReadRobot("codegen/robots/er20_like.toml");
    robot.name = "with_" + effect;
    robot.effect.clear();
    for (int joint = 0; joint < robot.joints(); ++joint) {
      armcal::codegen::EffectUse use;
      use.effect = effect;
      use.joints = {joint};
      if (effect == "stribeck") use.nonlinear = {{"delta", 2.0}, {"vs", 0.1}};
      if (effect == "presliding_dahl") use.nonlinear = {{"x0", 3e-3}};
      robot.effect.push_back(use);
    }
    const armcal::codegen::Model model(robot, armcal::codegen::ReadCatalogue("codegen/effects"));
    armcal::codegen::WriteFiles(armcal::codegen::Emit(model), *++folder);
  }
}
