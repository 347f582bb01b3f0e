// client - makes plain records of a trace's packed ones.
#pragma once

#include "host_sim/client/trace_reader.hpp"

namespace armcal::client {

struct Unpacked {
  TraceRecords records;     // channels kRawMotion | kRawFlags
  std::size_t unknown = 0;  // of all joints: positions that could not be told. Their flags are kStale.
};

// `packed`: channels kRawPacked, of `joints` joints. Positions are continued from record to record, and each joint's
// highest bits, which come in turn, say where the whole run lies. A run ends where the drive marks a joint stale and
// where ticks are missing; one that shows the highest bits less than twice is unknown. Throws LinkError if records
// contradict each other.
Unpacked Unpack(const TraceRecords& packed, int joints);

}  // namespace armcal::client
