// bags - walks over a JSON message.
#include "host_sim/data/bags/json_message.hpp"

#include <nlohmann/json.hpp>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"

namespace armcal::bags {

namespace {

using Json = nlohmann::ordered_json;
constexpr int kDeepestJson = 32;

class JsonWalk {
 public:
  JsonWalk(bool named, Flat& out) : named_(named), out_(out) {}

  void Message(const Json& message) {
    if (!message.is_object()) throw io::InputError("a JSON message is no object");
    if (const auto header = message.find("header"); header != message.end()) TakeStamp(*header);
    Object(message, "", {}, 0);
  }

 private:
  static bool IsNumber(const Json& value) { return value.is_number() || value.is_boolean(); }
  static double Number(const Json& value) {
    return value.is_boolean() ? static_cast<double>(value.get<bool>()) : value.get<double>();
  }

  static bool IsNames(const std::string& key, const Json& value) {
    return IsListOfNames(key) && value.is_array() && !value.empty() && value.size() <= kLongestArray &&
           std::all_of(value.begin(), value.end(), [](const Json& name) { return name.is_string(); });
  }

  // An object of a list of names and one list is a map from names to numbers.
  static bool IsMap(const Json& value) {
    if (!value.is_object() || value.size() != 2) return false;
    const auto first = value.begin(), second = std::next(first);
    return (IsNames(first.key(), *first) && second->is_array()) ||
           (IsNames(second.key(), *second) && first->is_array());
  }

  void TakeStamp(const Json& header) {
    const Json stamp = header.is_object() ? header.value("stamp", Json()) : Json();
    if (!stamp.is_object()) return;
    const Json second = stamp.value("sec", Json()), part = stamp.value("nanosec", stamp.value("nsec", Json()));
    if (!second.is_number_integer() || !part.is_number_integer()) return;
    const auto whole = second.get<std::int64_t>(), rest = part.get<std::int64_t>();
    constexpr std::int64_t kMost_s = std::int64_t{1} << 33, kPerSecond = 1000000000;
    if (whole >= 0 && whole < kMost_s && rest >= 0 && rest < kPerSecond) out_.stamp_ns = whole * kPerSecond + rest;
  }

  void Object(const Json& object, const std::string& path, const Scope& outer, int depth) {
    if (depth > kDeepestJson) throw io::InputError("a JSON message is nested too deeply");
    Scope own;
    const Scope* scope = &outer;
    const Json* list = nullptr;
    for (const auto& [key, value] : object.items())
      if (list == nullptr && IsNames(key, value)) list = &value;
    if (list != nullptr) {
      for (const Json& name : *list) {
        own.names.push_back(name.get_ref<const std::string&>());
        out_.AddToShape(own.names.back());
      }
      own.path = path.size();
      scope = &own;
    }
    const bool map = IsMap(object);
    out_.shape += '{';
    for (const auto& [key, value] : object.items()) {
      if (key == "header" || &value == list) continue;
      Member(key, value, path, *scope, map, depth);
    }
    out_.shape += '}';
  }

  void Member(const std::string& key, const Json& value, const std::string& path, const Scope& scope, bool map,
              int depth) {
    out_.AddToShape(key);
    if (IsNumber(value)) {
      Add(value, named_ ? path + "/" + key : "");
    } else if (value.is_object()) {
      Object(value, path + "/" + key, scope, depth + 1);
    } else if (value.is_array() && value.size() <= kLongestArray) {
      (out_.shape += std::to_string(value.size())) += ' ';
      for (std::size_t k = 0; k < value.size(); ++k) {
        const Json& element = value[k];
        const std::string at = ElementPath(path, key, k, value.size(), scope, map || IsMap(element));
        if (IsNumber(element)) Add(element, at);
        else if (element.is_object()) Object(element, at, {}, depth + 1);
        else out_.shape += '-';
      }
    } else {
      out_.shape += '-';
    }
  }

  void Add(const Json& value, const std::string& name) {
    out_.value.push_back(Number(value));
    out_.shape += '1';
    if (named_) out_.name.push_back(name);
  }

  bool named_;
  Flat& out_;
};

}  // namespace

void ReadJson(Bytes message, bool named, Flat& out) {
  out.Clear();
  const Json json = io::ParseJson(message);
  if (json.is_discarded()) throw io::InputError("a message is no JSON");
  JsonWalk(named, out).Message(json);
}

}  // namespace armcal::bags
