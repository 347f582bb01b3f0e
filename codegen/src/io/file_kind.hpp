// io - tells armcal's TOML files apart, so that one file in the place of another is called by its name.
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

enum class FileKind { kRobot, kTable, kChannelMap, kScenario };

// InputError: the file is of another kind. Keys that only one kind has decide. A file without them passes, and its
// reader says what it lacks.
inline void RequireKind(const toml::table& file, const std::filesystem::path& path, FileKind expected) {
  struct Known {
    FileKind kind;
    bool is;
    const char *name, *option;
  };
  const auto any = [&file](std::initializer_list<std::string_view> keys) {
    return std::any_of(keys.begin(), keys.end(), [&file](std::string_view key) { return file.contains(key); });
  };
  const Known known[] = {
      {FileKind::kTable, file.contains("schema") && file.contains("parameter"),
       "a parameter table (armcal identify --table-out writes it)", "--table"},
      {FileKind::kRobot, any({"dh", "urdf", "gravity_mps2"}), "a robot file", "--robot"},
      {FileKind::kScenario, file.contains("truth_seed"), "a scenario", "--scenario"},
      {FileKind::kChannelMap, any({"q", "tau", "tau_link"}), "a channel map (armcal channels writes it)", "--channels"},
  };
  const char* wanted = "";
  for (const Known& one : known)
    if (one.kind == expected) wanted = one.name;
  for (const Known& one : known) {
    if (!one.is) continue;
    if (one.kind == expected) return;
    const std::string name = one.name;
    throw InputError(path.string() + ": is " + name.substr(0, name.find(" (")) + ", expected " + wanted +
                     "; give this file as " + one.option);
  }
}

}  // namespace armcal::io
