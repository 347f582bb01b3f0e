// io - tells a URDF from a file of macros.
#pragma once

#include <string>

namespace armcal::io {

// The text holds macros or ${expressions} of xacro. Comments do not count: xacro leaves its input's comments in what it
// writes.
inline bool HoldsXacro(const std::string& xml) {
  for (std::size_t at = 0; (at = xml.find_first_of("<$", at)) != xml.npos;) {
    if (xml.compare(at, 7, "<xacro:") == 0 || xml.compare(at, 2, "${") == 0) return true;
    if (xml.compare(at, 4, "<!--") == 0) {
      at = xml.find("-->", at + 4);
      if (at == xml.npos) return false;
    } else {
      ++at;
    }
  }
  return false;
}

}  // namespace armcal::io
