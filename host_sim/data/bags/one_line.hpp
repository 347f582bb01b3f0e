// bags - keeps what a file says within one line of a message.
#pragma once

#include <string>

namespace armcal::bags {

// What a file says may hold any byte; a message is one line.
inline std::string OneLine(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7F') c = '?';
  constexpr std::size_t kLongest = 500;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

}  // namespace armcal::bags
