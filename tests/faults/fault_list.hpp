// faults - reads the lists of planted faults, <room>.toml; knows no source and no test.
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace armcal::faults {

struct Fault {
  std::string room;   // whose tests must notice
  std::string name;   // what is wrong, as a sentence
  std::string file;   // below the sources
  std::string right;  // text of the file, found once
  std::string wrong;  // what stands there instead
};

inline toml::table Parse(const std::string& path) {
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& e) {
    throw std::runtime_error(path + ":" + std::to_string(e.source().begin.line) + ": " + std::string(e.description()));
  }
}

// A fault's number is its place, from 1, rooms by name. Throws with one line for a reader.
inline std::vector<Fault> ReadFaults(const std::string& folder) {
  std::vector<std::filesystem::path> lists;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".toml") lists.push_back(entry.path());
  std::sort(lists.begin(), lists.end());
  std::vector<Fault> faults;
  for (const std::filesystem::path& list : lists) {
    const toml::table root = Parse(list.string());
    const toml::array* entries = root["fault"].as_array();
    if (entries == nullptr) throw std::runtime_error(list.string() + ": holds no [[fault]]");
    for (const toml::node& node : *entries) {
      const toml::table& table = *node.as_table();
      const auto text = [&](const char* key) {
        const auto value = table[key].value<std::string>();
        const std::string at = list.string() + ":" + std::to_string(node.source().begin.line);
        if (!value) throw std::runtime_error(at + ": a fault has a text \"" + key + "\"");
        return *value;
      };
      faults.push_back({list.stem().string(), text("name"), text("file"), text("right"), text("wrong")});
    }
  }
  return faults;
}

}  // namespace armcal::faults
