// io - numbers as text.
#pragma once

#include <charconv>
#include <string>

namespace armcal::io {

// The shortest text that reads back to the same double; it has a point, an exponent or a word.
inline std::string NumberText(double value) {
  char text[40];
  std::string s(text, std::to_chars(text, text + sizeof text, value).ptr);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

}  // namespace armcal::io
