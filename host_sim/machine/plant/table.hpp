// plant - looks up a value between points that a scenario gives.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "codegen/src/io/toml_reader.hpp"

namespace armcal::plant {

// Straight lines between the points, constant outside.
class Table {
 public:
  // Two keys with lists of one length; the first one rises.
  Table(const io::TomlReader& keys, const std::string& at, const std::string& value)
      : at_(keys.Numbers(at)), value_(keys.Numbers(value, at_.size())) {
    if (at_.size() < 2 || std::adjacent_find(at_.begin(), at_.end(), std::greater_equal<>()) != at_.end())
      keys.Fail(at, "two rising numbers or more");
  }
  double At(double x) const {
    const auto after = std::upper_bound(at_.begin(), at_.end(), x);
    if (after == at_.begin()) return value_.front();
    if (after == at_.end()) return value_.back();
    const auto k = static_cast<std::size_t>(after - at_.begin());
    const double share = (x - at_[k - 1]) / (at_[k] - at_[k - 1]);
    return value_[k - 1] + share * (value_[k] - value_[k - 1]);
  }

 private:
  std::vector<double> at_, value_;
};

}  // namespace armcal::plant
