// io - JSON from text and to text. The library's reader and writer are large; the rooms compile them here alone.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace armcal::io {

// The value that the text holds; is_discarded() if the text is no JSON.
nlohmann::ordered_json ParseJson(std::string_view text);

// The text of a value. indent: spaces for each level, a line for each value; -1: all in one line. Bytes that are no
// UTF-8 become U+FFFD.
std::string JsonText(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace armcal::io
