// tests - robots of codegen/robots by name, and their models.
#pragma once

#include <string>

#include "codegen/src/generator/model.hpp"

namespace armcal::tests {

inline codegen::Robot Read(const std::string& robot) { return codegen::ReadRobot("codegen/robots/" + robot + ".toml"); }

inline codegen::Model Load(const std::string& robot) {
  return codegen::Model(Read(robot), codegen::ReadCatalogue("codegen/effects"));
}

}  // namespace armcal::tests
