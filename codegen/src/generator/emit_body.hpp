// generator - prints the straight-line part of a graph; used by emit.cpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "codegen/src/generator/emit.hpp"

namespace armcal::codegen {

std::string NumberText(double value);  // shortest text that reads back to the same double

struct Assignment {
  std::string target;  // "front[3]"
  Expr value;
  std::string heading;  // a comment line before it where it differs from the one before; may be empty
};

// The C++ text of a graph input.
using InputWriter = std::function<std::string(const InputId& input)>;

// Statements that compute all assignments, in their order: each value just before its first use, so that few are alive
// at a time. input: C++ text of a graph input by name.
std::string EmitStatements(const Graph& graph, const std::vector<Assignment>& assignments, const InputWriter& input,
                           Passport& passport);

}  // namespace armcal::codegen
