// bags - reads messages in JSON.
#pragma once

#include "host_sim/data/bags/cursor.hpp"
#include "host_sim/data/bags/flat.hpp"

namespace armcal::bags {

// As ReadCdr. Numbers and truth values count; `header` holds the stamp: {"stamp": {"sec": 1, "nanosec": 2}}, or "nsec".
// InputError, without a file name: no JSON, nested too deeply, or a number that is not finite.
void ReadJson(Bytes message, bool named, Flat& out);

}  // namespace armcal::bags
