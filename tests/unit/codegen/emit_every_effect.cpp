// tests - writes the model with every effect into a folder, for the compiler.
#include <filesystem>
#include <fstream>

#include "codegen/src/generator/emit.hpp"
#include "tests/unit/codegen/every_effect.hpp"

int main(int, char** argument) {
  const std::filesystem::path folder = argument[1];
  std::filesystem::create_directories(folder);
  const armcal::codegen::GeneratedFiles files = armcal::codegen::Emit(armcal::tests::EveryEffect());
  for (const auto& [name, text] : files.text) std::ofstream(folder / name) << text;
}
