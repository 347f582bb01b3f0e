// client - reads the key of a drive from a file. The tool and the simulated drive use it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "codegen/src/io/input_error.hpp"

namespace armcal::client {

using Key = std::array<std::uint8_t, 32>;

// A text file of 64 hexadecimal digits, which only its owner may read. Throws io::InputError, which never holds a part
// of the key.
inline Key ReadKey(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  if (!fs::is_regular_file(path)) throw io::InputError(path.string() + ": no such file; expected the drive's key");
  constexpr auto kOthers = fs::perms::group_all | fs::perms::others_all;
  if ((fs::status(path).permissions() & kOthers) != fs::perms::none)
    throw io::InputError(path.string() + ": others may read or change this key; expected chmod 600");
  std::ifstream file(path);
  std::string digits, more;
  file >> digits;
  const bool alone = !(file >> more);
  Key key{};
  const bool hex = digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (!alone || !hex || digits.size() != 2 * key.size())
    throw io::InputError(path.string() + ": expected a key of 64 hexadecimal digits and nothing else");
  for (std::size_t k = 0; k < key.size(); ++k)
    key[k] = static_cast<std::uint8_t>(std::stoul(digits.substr(2 * k, 2), nullptr, 16));
  return key;
}

}  // namespace armcal::client
