// generate - makes the C++ model of a robot file, for armcal-generate and armcal generate.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace armcal::codegen {

struct GenerateOptions {
  std::string robot, out, json;
};

inline constexpr const char* kGenerateHelp =
    "make the C++ model of a robot file\nexample: armcal generate --robot er20_like --out build/model";

void AddGenerateOptions(CLI::App& verb, GenerateOptions& options);

// Writes the model and prints what it holds and costs. InputError, one line: file and key, and what was expected.
void Generate(const GenerateOptions& options);

}  // namespace armcal::codegen
