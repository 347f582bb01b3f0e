// generator - prints a model as C++ files, with a description for people and programs.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// Default share of the information kept per estimator sample, by forgetting group: bodies do not change, friction may
// in minutes.
inline constexpr double kForgetting[] = {0.999998, 0.99995, 0.99995, 1.0};

struct Passport {
  int multiplications = 0, additions = 0, divisions = 0, functions = 0, sincos = 0;
};

struct GeneratedFiles {
  std::map<std::string, std::string> text;  // file name -> content: model.hpp, model.json, COLUMNS.md, CMakeLists.txt
  std::uint32_t schema = 0;
  Passport passport;
};

// Byte-reproducible: no clock, no user, no path.
GeneratedFiles Emit(const Model& model);

// Into a folder, made if need be; each file whole or not at all. Throws io::InputError: a file cannot be written.
void WriteFiles(const GeneratedFiles& files, const std::filesystem::path& folder);

// The schema hash alone: equal for two models only if their tables mean the same.
std::uint32_t Schema(const Model& model);

}  // namespace armcal::codegen
