// survey - prints the firmware's model of the arm of (4) while building; knows no data.
#include <filesystem>
#include <fstream>

#include "codegen/src/generator/emit.hpp"
#include "host_sim/survey/arm.hpp"

int main(int, char** argument) {
  using namespace armcal;
  const codegen::Robot file = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const codegen::Model model(survey::StribeckArm(file, survey::SetStribeck(file.joints())),
                             survey::Records(codegen::ReadCatalogue("codegen/effects")));
  const std::filesystem::path folder = argument[1];
  std::filesystem::create_directories(folder);
  for (const auto& [name, text] : codegen::Emit(model).text) std::ofstream(folder / name) << text;
}
