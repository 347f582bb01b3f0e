// bags - runs work in a process of its own, for a library that damaged files can crash.
#pragma once

#include <functional>
#include <string>

namespace armcal::bags {

// The bytes that `work` returns. InputError: what `work` throws, or "is damaged" if it crashes or takes more than
// `most_s` seconds of the processor. Work may keep nothing, except what it returns.
std::string InChild(const std::function<std::string()>& work, unsigned most_s);

}  // namespace armcal::bags
