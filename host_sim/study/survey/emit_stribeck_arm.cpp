// survey - a program for the build: it prints the firmware's model of the arm with friction law (4).
#include "codegen/src/generator/emit.hpp"
#include "host_sim/study/survey/arm.hpp"

int main(int, char** folder) {
  using namespace armcal;
  const codegen::Robot file = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const codegen::Model model(survey::StribeckArm(file, survey::SetStribeck(file.joints())),
                             survey::Records(codegen::ReadCatalogue("codegen/effects")));
  codegen::WriteFiles(codegen::Emit(model), folder[1]);
}
