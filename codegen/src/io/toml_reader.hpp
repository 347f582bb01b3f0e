// io - reads one TOML table with one-line errors.
#pragma once

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

// A table together with the words needed for an error: "file: key: expected ...".
class TomlReader {
 public:
  TomlReader(const toml::table& table, std::string file, std::string prefix = "")
      : table_(table), file_(std::move(file)), prefix_(std::move(prefix)) {}

  [[noreturn]] void Fail(std::string_view key, const std::string& expected) const {
    throw InputError(file_ + ": " + prefix_ + std::string(key) + ": expected " + expected);
  }
  bool Has(std::string_view key) const { return table_.contains(key); }

  double Number(std::string_view key) const {
    const auto v = table_[key].value<double>();
    if (!v || !std::isfinite(*v)) Fail(key, "a finite number");
    return *v;
  }
  double Number(std::string_view key, double otherwise) const { return Has(key) ? Number(key) : otherwise; }
  double Positive(std::string_view key) const {
    const double v = Number(key);
    if (!(v > 0)) Fail(key, "a number above zero");
    return v;
  }
  std::string Text(std::string_view key) const {
    const auto v = table_[key].value<std::string>();
    if (!v) Fail(key, "a string");
    return *v;
  }
  std::string Text(std::string_view key, const std::string& otherwise) const {
    return Has(key) ? Text(key) : otherwise;
  }
  bool Flag(std::string_view key, bool otherwise) const {
    if (!Has(key)) return otherwise;
    const auto v = table_[key].value<bool>();
    if (!v) Fail(key, "true or false");
    return *v;
  }
  // size 0: any length.
  std::vector<double> Numbers(std::string_view key, std::size_t size = 0) const {
    const auto* array = table_[key].as_array();
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
  std::vector<std::string> Texts(std::string_view key) const {
    std::vector<std::string> out;
    if (!Has(key)) return out;
    const auto* array = table_[key].as_array();
    if (!array) Fail(key, "an array of strings");
    for (const auto& item : *array) {
      const auto v = item.value<std::string>();
      if (!v) Fail(key, "an array of strings");
      out.push_back(*v);
    }
    return out;
  }
  TomlReader Table(std::string_view key) const {
    const auto* t = table_[key].as_table();
    if (!t) Fail(key, "a table");
    return {*t, file_, prefix_ + std::string(key) + "."};
  }
  std::vector<TomlReader> Tables(std::string_view key) const {
    std::vector<TomlReader> out;
    if (!Has(key)) return out;
    const auto* array = table_[key].as_array();
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
      const auto known = [&](auto list) { return std::find(list.begin(), list.end(), k.str()) != list.end(); };
      if (!known(keys) && !known(more)) Fail(k.str(), "no such key here");
    }
  }
  void AllowOnly(std::initializer_list<std::string_view> keys) const {
    AllowOnly(std::span(keys.begin(), keys.size()));
  }
  const toml::table& table() const { return table_; }
  const std::string& file() const { return file_; }

 private:
  const toml::table& table_;
  std::string file_, prefix_;
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
