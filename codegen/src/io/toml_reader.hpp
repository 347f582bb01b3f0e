// io - reads the keys of a TOML file. Every problem is one line with file, key and what was expected.
#pragma once

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

// A table together with the words needed for an error: "file: key: expected ...". The table must outlive this object.
// A reader remembers which keys it was asked for, so that Finish can refuse all others.
class TomlReader {
 public:
  TomlReader(const toml::table& table, std::string file, std::string prefix = "")
      : table_(table), file_(std::move(file)), prefix_(std::move(prefix)) {}

  [[noreturn]] void Fail(std::string_view key, const std::string& expected) const {
    throw InputError(file_ + ": " + prefix_ + std::string(key) + ": expected " + expected);
  }
  bool Has(std::string_view key) const { return !!Node(key); }

  double Number(std::string_view key) const {
    const auto node = Node(key);
    const auto v = node.value<double>();
    if (!v || !std::isfinite(*v) || node.is_boolean()) Fail(key, "a finite number");
    return *v;
  }
  double Number(std::string_view key, double otherwise) const { return Has(key) ? Number(key) : otherwise; }
  double Positive(std::string_view key) const {
    const double v = Number(key);
    if (!(v > 0)) Fail(key, "a number above zero");
    return v;
  }
  double Positive(std::string_view key, double otherwise) const { return Has(key) ? Positive(key) : otherwise; }
  double NotNegative(std::string_view key) const {
    const double v = Number(key);
    if (!(v >= 0)) Fail(key, "a number not below zero");
    return v;
  }
  double NotNegative(std::string_view key, double otherwise) const { return Has(key) ? NotNegative(key) : otherwise; }
  // In [lowest, highest].
  std::int64_t Integer(std::string_view key, std::int64_t lowest, std::int64_t highest) const {
    const auto v = Node(key).value_exact<std::int64_t>();
    if (!v || *v < lowest || *v > highest)
      Fail(key, "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest));
    return *v;
  }
  std::int64_t Integer(std::string_view key, std::int64_t lowest, std::int64_t highest, std::int64_t otherwise) const {
    return Has(key) ? Integer(key, lowest, highest) : otherwise;
  }
  std::string Text(std::string_view key) const {
    const auto v = Node(key).value<std::string>();
    if (!v) Fail(key, "a string");
    return *v;
  }
  std::string Text(std::string_view key, const std::string& otherwise) const {
    return Has(key) ? Text(key) : otherwise;
  }
  bool Flag(std::string_view key, bool otherwise) const {
    if (!Has(key)) return otherwise;
    const auto v = Node(key).value<bool>();
    if (!v) Fail(key, "true or false");
    return *v;
  }
  // size 0: any length.
  std::vector<double> Numbers(std::string_view key, std::size_t size = 0) const {
    const auto* array = Node(key).as_array();
    const std::string expected = size ? std::to_string(size) + " numbers" : "an array of numbers";
    if (!array || (size && array->size() != size)) Fail(key, expected);
    std::vector<double> out;
    for (const auto& item : *array) {
      const auto v = item.value<double>();
      if (!v || !std::isfinite(*v)) Fail(key, expected);
      out.push_back(*v);
    }
    return out;
  }
  // One number, or an array of any length.
  std::vector<double> NumberOrNumbers(std::string_view key, const std::vector<double>& otherwise) const {
    if (!Has(key)) return otherwise;
    return Node(key).is_array() ? Numbers(key) : std::vector<double>{Number(key)};
  }
  std::vector<std::string> Texts(std::string_view key) const {
    std::vector<std::string> out;
    if (!Has(key)) return out;
    const auto* array = Node(key).as_array();
    if (!array) Fail(key, "an array of strings");
    for (const auto& item : *array) {
      const auto v = item.value<std::string>();
      if (!v) Fail(key, "an array of strings");
      out.push_back(*v);
    }
    return out;
  }
  TomlReader Table(std::string_view key) const {
    const auto* t = Node(key).as_table();
    if (!t) Fail(key, "a table");
    return {*t, file_, prefix_ + std::string(key) + "."};
  }
  std::vector<TomlReader> Tables(std::string_view key) const {
    std::vector<TomlReader> out;
    if (!Has(key)) return out;
    const auto* array = Node(key).as_array();
    if (!array) Fail(key, "an array of tables ([[" + std::string(key) + "]])");
    int i = 0;
    for (const auto& item : *array) {
      const auto* t = item.as_table();
      if (!t) Fail(key, "an array of tables ([[" + std::string(key) + "]])");
      out.emplace_back(*t, file_, prefix_ + std::string(key) + "[" + std::to_string(++i) + "].");
    }
    return out;
  }
  // A misspelt key is an error, not a silence.
  void AllowOnly(std::span<const std::string_view> keys, std::span<const std::string_view> more = {}) const {
    for (const auto& [k, v] : table_) {
      const std::string_view key = k.str();
      const auto known = [key](auto list) { return std::find(list.begin(), list.end(), key) != list.end(); };
      if (!known(keys) && !known(more)) Fail(key, "no such key here");
    }
  }
  void AllowOnly(std::initializer_list<std::string_view> keys) const {
    AllowOnly(std::span(keys.begin(), keys.size()));
  }
  // The same, where the keys depend on what is read: refuses keys that nobody has asked for.
  void Finish() const {
    std::string known;
    for (const std::string& key : asked_) known += " " + key;
    for (const auto& [key, value] : table_)
      if (!asked_.contains(key.str()))
        throw InputError(file_ + ": " + prefix_ + std::string(key.str()) + ": unknown key, expected one of:" + known);
  }
  const toml::table& table() const { return table_; }
  const std::string& file() const { return file_; }

 private:
  toml::node_view<const toml::node> Node(std::string_view key) const {
    asked_.emplace(key);
    return table_[key];
  }

  const toml::table& table_;
  std::string file_, prefix_;
  mutable std::set<std::string, std::less<>> asked_;
};

inline toml::table ParseToml(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) throw InputError(path.string() + ": no such file");
  try {
    return toml::parse_file(path.string());
  } catch (const toml::parse_error& e) {
    throw InputError(path.string() + ": line " + std::to_string(e.source().begin.line) + ", column " +
                     std::to_string(e.source().begin.column) + ": " + std::string(e.description()));
  }
}

}  // namespace armcal::io
