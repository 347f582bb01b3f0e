// plant - strict reading of one TOML table: every problem is one line with file and key; knows no key itself.
#pragma once

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <toml++/toml.h>

#include "codegen/src/io/input_error.hpp"

namespace armcal::plant {

// Parses a whole file. Throws io::InputError for a missing file or a syntax error (with its line).
inline toml::table ParseTomlFile(const std::string& path) {
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& e) {
    const auto line = e.source().begin.line;
    throw io::InputError(path + (line ? ":" + std::to_string(line) : "") + ": " + std::string(e.description()) +
                         ", expected a readable TOML file");
  }
}

// One table of a file. Getters remember what was asked for, so that Finish can refuse what nobody knows.
class TomlKeys {
 public:
  // where: what a message names, "file: " or "file: effect[2]."; the table must outlive this object.
  TomlKeys(const toml::table& table, std::string where) : table_(table), where_(std::move(where)) {}

  [[noreturn]] void Fail(const std::string& key, const std::string& expected) const {
    throw io::InputError(where_ + key + ": expected " + expected);
  }
  bool Has(const std::string& key) {
    known_.insert(key);
    return table_.contains(key);
  }

  std::string Text(const std::string& key) {
    const auto value = Node(key).value_exact<std::string>();
    if (!value) Fail(key, "a text");
    return *value;
  }
  double Number(const std::string& key) {
    const auto value = Node(key).value<double>();
    if (!value || !std::isfinite(*value) || Node(key).is_boolean()) Fail(key, "a number");
    return *value;
  }
  double Number(const std::string& key, double fallback) { return Has(key) ? Number(key) : fallback; }
  double Positive(const std::string& key) { return AtLeast(key, Number(key), true); }
  double Positive(const std::string& key, double fallback) { return AtLeast(key, Number(key, fallback), true); }
  double NotNegative(const std::string& key) { return AtLeast(key, Number(key), false); }
  double NotNegative(const std::string& key, double fallback) { return AtLeast(key, Number(key, fallback), false); }

  // An integer in [lowest, highest].
  long long Integer(const std::string& key, long long lowest, long long highest) {
    const auto value = Node(key).value_exact<int64_t>();
    if (!value || *value < lowest || *value > highest)
      Fail(key, "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest));
    return *value;
  }
  long long Integer(const std::string& key, long long lowest, long long highest, long long fallback) {
    return Has(key) ? Integer(key, lowest, highest) : fallback;
  }

  std::vector<double> Numbers(const std::string& key, std::size_t count) {
    const toml::array* array = Node(key).as_array();
    std::vector<double> values;
    if (array) {
      for (const auto& item : *array)
        if (const auto value = item.value<double>(); value && std::isfinite(*value)) values.push_back(*value);
    }
    if (!array || values.size() != array->size() || values.size() != count)
      Fail(key, std::to_string(count) + " numbers in brackets");
    return values;
  }

  // One number for every joint, or a list of any length.
  std::vector<double> NumberOrNumbers(const std::string& key, const std::vector<double>& fallback) {
    if (!Has(key)) return fallback;
    const toml::array* array = Node(key).as_array();
    return array ? Numbers(key, array->size()) : std::vector<double>{Number(key)};
  }

  TomlKeys Table(const std::string& key) {
    const toml::table* table = Node(key).as_table();
    if (!table) Fail(key, "a table");
    return {*table, where_ + key + "."};
  }
  // The tables of [[key]], none if the key is not there.
  std::vector<TomlKeys> Tables(const std::string& key) {
    std::vector<TomlKeys> tables;
    if (!Has(key)) return tables;
    const toml::array* array = Node(key).as_array();
    if (!array || !array->is_array_of_tables()) Fail(key, "tables written [[" + key + "]]");
    for (const auto& item : *array)
      tables.emplace_back(*item.as_table(), where_ + key + "[" + std::to_string(tables.size() + 1) + "].");
    return tables;
  }

  // Refuses keys that nobody asked for.
  void Finish() const {
    for (const auto& [key, value] : table_)
      if (!known_.contains(std::string(key.str())))
        throw io::InputError(where_ + std::string(key.str()) + ": unknown key" + KnownKeys());
  }

 private:
  const toml::node& Node(const std::string& key) {
    known_.insert(key);
    const toml::node* node = table_.get(key);
    if (!node) Fail(key, "this key, which is missing");
    return *node;
  }
  double AtLeast(const std::string& key, double value, bool strict) const {
    if (strict ? !(value > 0) : !(value >= 0)) Fail(key, strict ? "a number above 0" : "a number not below 0");
    return value;
  }
  std::string KnownKeys() const {
    std::string text = ", expected one of:";
    for (const auto& key : known_) text += " " + key;
    return text;
  }

  const toml::table& table_;
  std::string where_;
  std::set<std::string> known_;
};

}  // namespace armcal::plant
