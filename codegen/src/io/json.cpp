// io - the one place where JSON is read and written.
#include "codegen/src/io/json.hpp"

#include <nlohmann/json.hpp>

namespace armcal::io {

using nlohmann::ordered_json;

ordered_json ParseJson(std::string_view text) { return ordered_json::parse(text, nullptr, false); }

std::string JsonText(const ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace armcal::io
