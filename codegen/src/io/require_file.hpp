// io - refuses a path that names no file, and a file that may not be read.
#pragma once

#include <unistd.h>

#include <filesystem>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

// InputError: nothing is there, or a folder, or a file that may not be read.
inline void RequireFile(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw InputError(path.string() + ": no such file; check the path");
  if (std::filesystem::is_directory(path, error)) throw InputError(path.string() + ": is a folder, expected a file");
  if (access(path.c_str(), R_OK) != 0) throw InputError(path.string() + ": may not be read; check its permissions");
}

}  // namespace armcal::io
