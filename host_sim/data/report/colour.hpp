// report - colours a few words for a person who looks at a terminal.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace armcal::report {

enum class Ink { kRed = 31, kGreen = 32, kYellow = 33 };

// The text in this colour where `stream` is a terminal and the environment has no NO_COLOR; elsewhere as it is, so that
// files and pipes hold plain text.
inline std::string Coloured(const std::string& text, Ink ink, std::FILE* stream = stdout) {
  const char* const no_colour = std::getenv("NO_COLOR");
  if (isatty(fileno(stream)) != 1 || (no_colour != nullptr && *no_colour != '\0')) return text;
  return "\033[" + std::to_string(static_cast<int>(ink)) + "m" + text + "\033[0m";
}

}  // namespace armcal::report
