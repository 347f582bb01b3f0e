// io - reads the keys of a TOML file. Every problem is one line with file, key and what was expected.
#pragma once

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/src/io/faults.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/require_file.hpp"

namespace armcal::io {

// A table together with the words needed for an error: "file: key: expected ...". The table must outlive this object.
// A reader remembers which keys it was asked for, so that Finish can refuse all others.
// With `faults` a problem is kept there and reading goes on: a bad number reads as NaN, a bad text as "", a bad array
// as NaNs or as empty, a missing table as an empty one that complains no more. Without, the first problem throws.
class TomlReader {
 public:
  TomlReader(const toml::table& table, std::string file, std::string prefix = "", Faults* faults = nullptr)
      : table_(table), file_(std::move(file)), prefix_(std::move(prefix)), faults_(faults) {}

  [[noreturn]] void Fail(std::string_view key, const std::string& expected) const {
    throw InputError(Line(key, expected));
  }
  // What Fail says; thrown only where nobody collects.
  void Report(std::string_view key, const std::string& expected) const {
    if (Has(key) || !misspelt_.contains(key)) Keep(Line(key, expected));
  }
  bool Has(std::string_view key) const { return !!Node(key); }

  double Number(std::string_view key) const {
    const auto node = Node(key);
    const auto v = node.value<double>();
    if (v && std::isfinite(*v) && !node.is_boolean()) return *v;
    Report(key, "a finite number");
    return kNaN;
  }
  double Number(std::string_view key, double otherwise) const { return Has(key) ? Number(key) : otherwise; }
  double Positive(std::string_view key) const {
    return Checked(key, "a number above zero", [](double v) { return v > 0; });
  }
  double Positive(std::string_view key, double otherwise) const { return Has(key) ? Positive(key) : otherwise; }
  double NotNegative(std::string_view key) const {
    return Checked(key, "a number not below zero", [](double v) { return v >= 0; });
  }
  double NotNegative(std::string_view key, double otherwise) const { return Has(key) ? NotNegative(key) : otherwise; }
  // In [lowest, highest].
  std::int64_t Integer(std::string_view key, std::int64_t lowest, std::int64_t highest) const {
    const auto v = Node(key).value_exact<std::int64_t>();
    if (v && *v >= lowest && *v <= highest) return *v;
    Report(key, "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest));
    return lowest;
  }
  std::int64_t Integer(std::string_view key, std::int64_t lowest, std::int64_t highest, std::int64_t otherwise) const {
    return Has(key) ? Integer(key, lowest, highest) : otherwise;
  }
  std::string Text(std::string_view key) const {
    const auto v = Node(key).value<std::string>();
    if (!v) Report(key, "a string");
    return v.value_or("");
  }
  std::string Text(std::string_view key, const std::string& otherwise) const {
    return Has(key) ? Text(key) : otherwise;
  }
  bool Flag(std::string_view key, bool otherwise) const {
    if (!Has(key)) return otherwise;
    const auto v = Node(key).value<bool>();
    if (!v) Report(key, "true or false");
    return v.value_or(otherwise);
  }
  // size 0: any length.
  std::vector<double> Numbers(std::string_view key, std::size_t size = 0) const {
    const auto* array = Node(key).as_array();
    const std::string expected = size ? std::to_string(size) + " numbers" : "an array of numbers";
    const auto bad = [&] {
      Report(key, expected);
      return std::vector<double>(size, kNaN);
    };
    if (!array || (size && array->size() != size)) return bad();
    std::vector<double> out;
    for (const auto& item : *array) {
      const auto v = item.value<double>();
      if (!v || !std::isfinite(*v)) return bad();
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
    if (!array) Report(key, "an array of strings");
    for (std::size_t k = 0; array && k < array->size(); ++k) {
      const auto v = (*array)[k].value<std::string>();
      if (!v) Report(key, "an array of strings");
      else out.push_back(*v);
    }
    return out;
  }
  TomlReader Table(std::string_view key) const {
    const auto* t = Node(key).as_table();
    if (t) return {*t, file_, prefix_ + std::string(key) + ".", faults_};
    Report(key, "a table");
    static const toml::table kNothing;
    TomlReader nothing(kNothing, file_, prefix_ + std::string(key) + ".", faults_);
    nothing.mute_ = true;
    return nothing;
  }
  std::vector<TomlReader> Tables(std::string_view key) const {
    std::vector<TomlReader> out;
    if (!Has(key)) return out;
    const auto* array = Node(key).as_array();
    if (!array) Report(key, "an array of tables ([[" + std::string(key) + "]])");
    int i = 0;
    for (std::size_t k = 0; array && k < array->size(); ++k) {
      const auto* t = (*array)[k].as_table();
      if (!t) Report(key, "an array of tables ([[" + std::string(key) + "]])");
      else out.emplace_back(*t, file_, prefix_ + std::string(key) + "[" + std::to_string(++i) + "].", faults_);
    }
    return out;
  }
  // A misspelt key is an error, not a silence. The line names the nearest key that is not there yet, or all of them if
  // none is near. The nearest one is then not called missing besides.
  void AllowOnly(std::span<const std::string_view> keys, std::span<const std::string_view> more = {}) const {
    std::vector<std::string_view> absent;
    for (const auto list : {keys, more})
      for (const std::string_view key : list)
        if (!table_.contains(key)) absent.push_back(key);
    for (const auto& [k, v] : table_) {
      const std::string_view key = k.str();
      const auto known = [key](auto list) { return std::find(list.begin(), list.end(), key) != list.end(); };
      if (known(keys) || known(more)) continue;
      const std::string nearest = Nearest(key, absent);
      Keep(Unknown(key, nearest.empty() ? OneOf(absent) : "; the nearest is " + nearest));
      if (!nearest.empty()) misspelt_.insert(nearest);
    }
  }
  void AllowOnly(std::initializer_list<std::string_view> keys) const {
    AllowOnly(std::span(keys.begin(), keys.size()));
  }
  // The same, where the keys depend on what is read: refuses keys that nobody has asked for.
  void Finish() const {
    for (const auto& [key, value] : table_)
      if (!asked_.contains(key.str())) throw InputError(Unknown(key.str(), OneOf(asked_)));
  }
  const toml::table& table() const { return table_; }
  const std::string& file() const { return file_; }

 private:
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  std::string Line(std::string_view key, const std::string& expected) const {
    return file_ + ": " + prefix_ + std::string(key) + ": " + (Has(key) ? "" : "missing, ") + "expected " + expected;
  }
  std::string Unknown(std::string_view key, const std::string& remedy) const {
    return file_ + ": " + prefix_ + std::string(key) + ": unknown key" + remedy;
  }
  template <class Keys>
  static std::string OneOf(const Keys& keys) {
    std::string out;
    for (const auto& key : keys) out += (out.empty() ? ", expected one of: " : ", ") + std::string(key);
    return out.empty() ? ", expected none" : out;
  }
  void Keep(const std::string& line) const {
    if (mute_) return;
    if (!faults_) throw InputError(line);
    faults_->Add(line);
  }
  template <class Holds>
  double Checked(std::string_view key, const char* expected, Holds holds) const {
    const auto node = Node(key);
    const auto v = node.value<double>();
    if (v && std::isfinite(*v) && !node.is_boolean() && holds(*v)) return *v;
    Report(key, expected);
    return kNaN;
  }
  toml::node_view<const toml::node> Node(std::string_view key) const {
    asked_.emplace(key);
    return table_[key];
  }

  const toml::table& table_;
  std::string file_, prefix_;
  Faults* faults_ = nullptr;
  bool mute_ = false;
  mutable std::set<std::string, std::less<>> asked_, misspelt_;  // misspelt_: the keys that were probably meant
};

inline toml::table ParseToml(const std::filesystem::path& path) {
  RequireFile(path);
  try {
    return toml::parse_file(path.string());
  } catch (const toml::parse_error& e) {
    std::string what(e.description());  // "Error while parsing key-value pair: expected '=', saw ','"
    constexpr std::string_view kWhile = "Error while parsing ";
    what = what.starts_with(kWhile) ? " in " + what.substr(kWhile.size()) : ": " + what;
    throw InputError(path.string() + ": line " + std::to_string(e.source().begin.line) + ", column " +
                     std::to_string(e.source().begin.column) + ": wrong TOML" + what);
  }
}

}  // namespace armcal::io
