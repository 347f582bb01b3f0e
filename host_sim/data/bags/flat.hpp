// bags - a message as numbers with names.
//
// A name is the topic and the path of the field: "/ft/wrench/force/x", "/cmd/data[0]". If a message names its elements
// (a list `name`, `names`, `joint_names` or `interface_names`), an array with as many numbers is told apart by these
// names and not by places: "/joint_states/elbow/position". So a message may list its joints in any order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace armcal::bags {

inline constexpr std::size_t kLongestArray = 256;  // a longer one is a picture or a scan; its numbers are left out

struct Flat {
  std::vector<double> value;
  std::string shape;              // messages with the same shape have the same names
  std::vector<std::string> name;  // of each value, without the topic; empty unless they were asked for
  std::int64_t stamp_ns = 0;      // header.stamp; 0: there is none

  // With its length, so that no other texts give the same shape.
  void AddToShape(std::string_view text) { ((shape += std::to_string(text.size())) += ':') += text; }
  void Clear() {
    value.clear(), shape.clear(), name.clear();
    stamp_ns = 0;
  }
};

inline bool IsListOfNames(std::string_view field) {
  constexpr std::string_view kLists[] = {"name", "names", "joint_names", "interface_names"};
  return std::find(std::begin(kLists), std::end(kLists), field) != std::end(kLists);
}

// Names that hold within a struct, and where the path of this struct ends.
struct Scope {
  std::vector<std::string_view> names;
  std::size_t path = 0;
};

// The path of element `k` of the array `field`, which has `count` elements, in the struct at `path`. Elements that the
// scope names get the name where the scope begins. `whole`: the name stands for the field, too.
inline std::string ElementPath(const std::string& path, std::string_view field, std::size_t k, std::size_t count,
                               const Scope& scope, bool whole) {
  std::string out = path;
  if (scope.names.size() == count && count > 0) {
    out.insert(scope.path, "/" + std::string(scope.names[k]));
    if (!whole) (out += '/') += field;
    return out;
  }
  ((((out += '/') += field) += '[') += std::to_string(k)) += ']';
  return out;
}

}  // namespace armcal::bags
