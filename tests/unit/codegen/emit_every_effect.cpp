// tests - writes the model with every effect into a folder, for the compiler.
#include "codegen/src/generator/emit.hpp"
#include "tests/unit/codegen/every_effect.hpp"

int main(int, char** folder) {
  armcal::codegen::WriteFiles(armcal::codegen::Emit(armcal::tests::EveryEffect()), folder[1]);
}
