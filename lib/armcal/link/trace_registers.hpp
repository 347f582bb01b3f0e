// link - serves a trace as registers; knows where its pages and its arm lie, not what is recorded.
#pragma once

#include "armcal/link/register_map.hpp"
#include "armcal/link/trace.hpp"

namespace armcal::link {

// Serves `trace` as number 0 (raw samples) or 1 (processed samples): page, arm and acknowledge.
// kOutOfRange: no such number; kBadAddress: that number is served already; kFull. Context: background.
core::Status ServeTrace(RegisterMap& map, int number, Trace& trace);

}  // namespace armcal::link
