// survey - prints the firmware's model of the arm of (4) while building; knows no data.
#include "codegen/src/generator/emit.hpp"
#include "host_sim/study/survey/arm.hpp"

int main(int, char** folder) {
  using namespace armcal;
  const codegen::Robot file = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const codegen::Model model(survey::StribeckArm(file, survey::SetStribeck(file.joints())),
                             survey::Records(codegen::ReadCatalogue("codegen/effects")));
  codegen::WriteFiles(codegen::Emit(model), folder[1]);
}
